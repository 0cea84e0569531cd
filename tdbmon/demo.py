"""The demo: the main job on the synthetic records that ship with tdbmon."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.atomic import write_bytes, write_text
from tdbmon.record.read import read
from tdbmon.report.drop_report import build_report
from tdbmon.report.html import write_html
from tdbmon.report.pdf import render_first_page, write_pdf
from tdbmon.shipped import shipped

SYNTHETIC = "Synthetic record: made by an independent rig program, not measured on a machine."


def run_demo(out: Path, progress: Callable[[str], None]) -> list[str]:
    """Analyse the shipped coast-downs, write JSON, HTML and PDF of each; return the lines to show."""
    out.mkdir(parents=True, exist_ok=True)
    machine = load_machine(shipped("coastdown/machine.toml"))
    lines = []
    for name in ("drop_100", "drop_150"):

        def tell(step: str, name: str = name) -> None:
            progress(f"{name}: {step}")

        result = analyse(read(shipped(f"coastdown/{name}.nc")), machine, tell)
        progress(f"{name}: drawing the figures and writing the reports")
        document = build_report(result, note=SYNTHETIC)
        write_html(document, out / f"{name}.html")
        write_pdf(document, out / f"{name}.pdf")
        write_text(out / f"{name}.json", json.dumps(analysis_json(result), indent=1, allow_nan=False) + "\n")
        write_bytes(out / f"{name}.png", render_first_page(document))
        lines.append(f"{name}: {out / name}.html  {out / name}.pdf  {out / name}.json")
    return [SYNTHETIC, *lines, f"open {out / 'drop_100.html'} in a browser"]
