"""`tdbmon diagnose`: it calls the library and writes; nothing is computed here."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr
from tdbsim.machine import load_machine

from tdbmon.diagnosis.contract import diagnosis_json, diagnosis_lines
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.diagnose import diagnose as run
from tdbmon.diagnosis.extended_machine import extended_head, extended_machine
from tdbmon.diagnosis.reference import Reference, diagnose_since
from tdbmon.diagnosis.reference_contract import reference_json, reference_lines
from tdbmon.identify.crew import all_cores
from tdbmon.json_file import say, write_json
from tdbmon.machine_file import check_suffix, write_machine
from tdbmon.output_file import check_outputs
from tdbmon.progress import on_terminal
from tdbmon.record.read import read
from tdbmon.report_file import check_reports, draw_reports

if TYPE_CHECKING:
    from tdbmon.report.document import Document


def diagnose(
    machine: Path,
    records: list[Path],
    json_file: Path | None,
    report: list[Path] | None,
    extended: Path | None,
    reference: list[Path] | None,
) -> None:
    """Diagnose drops, by themselves or since earlier ones, and write what was asked for."""
    check_reports(report)
    check_suffix(extended)
    check_outputs([json_file, *(report or []), extended], [machine, *records, *(reference or [])])
    with on_terminal() as tell:
        tell("reading the machine and the records")
        plan = load_machine(machine)
        channels, before = [read(path) for path in records], [read(path) for path in reference or []]
        since = None
        if before:
            result, since = diagnose_since(plan, before, channels, tell, all_cores())
        else:
            result = run(plan, channels, tell, all_cores())
    lines, content = diagnosis_lines(result), diagnosis_json(result)
    if since is not None:
        lines, content = [*reference_lines(since), *lines], {**content, "reference": reference_json(since)}
    written = write_json(json_file, content)
    if extended is not None:
        written.append(_write_extended(result, extended))
    # before the figures: what took minutes to find is not lost with one that can't be drawn
    say([*lines, *written])
    draw_reports(report, lambda _: _document(result, since, channels))


def _document(result: Diagnosis, since: Reference | None, channels: Sequence[xr.Dataset]) -> Document:
    from tdbmon.record.synthetic import is_synthetic, synthetic_note
    from tdbmon.report.diagnosis_report import build_diagnosis_report

    computed = any(is_synthetic(each.attrs) for each in channels)
    return build_diagnosis_report(result, note=synthetic_note(len(channels)) if computed else "", since=since)


def _write_extended(result: Diagnosis, path: Path) -> str:
    """Write the machine file with the named causes and return the line that says so."""
    wider = extended_machine(result)
    if wider is None:
        there = "; the existing file is from an earlier run" if path.exists() else ""
        return f"{path} not written: no cause was named{there}"
    write_machine(wider, path, extended_head(result))
    return f"extended machine file: {path}"
