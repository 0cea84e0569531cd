"""The demo: analysis, diagnosis and archive on the synthetic records that ship with tdbmon."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from itertools import chain
from multiprocessing import get_context
from pathlib import Path

from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.atomic import write_bytes
from tdbmon.diagnosis.contract import diagnosis_json, diagnosis_lines
from tdbmon.diagnosis.diagnose import diagnose
from tdbmon.diagnosis.extended_machine import extended_head, extended_machine
from tdbmon.history.archive import open_archive
from tdbmon.history.batch import add_all
from tdbmon.history.contract import comparison_json
from tdbmon.history.machine_history import machine_history
from tdbmon.history.study import Order
from tdbmon.identify.contract import force_lines, with_fitted
from tdbmon.identify.crew import attend_parent
from tdbmon.identify.fitted import fit_drop
from tdbmon.json_file import write_json
from tdbmon.machine_file import write_machine
from tdbmon.progress import Progress, silent
from tdbmon.record.read import read
from tdbmon.record.synthetic import synthetic_note
from tdbmon.report.compare_report import build_compare_report
from tdbmon.report.diagnosis_report import build_diagnosis_report
from tdbmon.report.document import Document
from tdbmon.report.drop_report import build_report
from tdbmon.report.html import write_html
from tdbmon.report.machine_report import build_machine_report
from tdbmon.report.pdf import render_first_page, write_pdf
from tdbmon.shipped import shipped

_COASTDOWNS = ("drop_100", "drop_150")
_WORKERS = 2


def run_demo(out: Path, progress: Progress) -> list[str]:
    """Analyse the shipped records and write JSON, HTML and PDF; return the lines to show."""
    out.mkdir(parents=True, exist_ok=True)
    parts = [partial(_hidden_fault, out), *(partial(_coastdown, name, out) for name in _COASTDOWNS)]
    # the longest first, one process each: much of each part is serial
    with ProcessPoolExecutor(_WORKERS, get_context("spawn"), attend_parent) as pool:
        begun = [pool.submit(part) for part in parts]
        for done, _ in enumerate(chain([None], as_completed(begun))):
            progress(
                f"a hidden fault and {len(_COASTDOWNS)} coast-downs, on {_WORKERS} processes: {done} of {len(begun)} done"
            )
        diagnosis, *coastdowns = (each.result() for each in begun)
    lines = [*chain.from_iterable(coastdowns), *diagnosis, *_years(out, progress)]
    return [synthetic_note(len(_COASTDOWNS)), *lines, f"open {out / 'drop_100.html'} in a browser"]


def _coastdown(name: str, out: Path) -> list[str]:
    """Analyse a whole coast-down and fit the simulation to its first contacts; write JSON and reports."""
    machine, record = load_machine(shipped("coastdown/machine.toml")), read(shipped(f"coastdown/{name}.nc"))
    result = analyse(record, machine)
    fitted = fit_drop(machine, record, silent).beside(result).with_coast_down(result)
    document = build_report(result, fitted=fitted)
    _write(document, out, name)
    write_json(out / f"{name}.json", with_fitted(analysis_json(result), fitted))
    write_bytes(out / f"{name}.png", render_first_page(document))
    return [
        f"{name}: {out / name}.html  {out / name}.pdf  {out / name}.json",
        *(f"  {line}" for line in force_lines(fitted.calibration, fitted.forces)),
    ]


def _hidden_fault(out: Path) -> list[str]:
    """Diagnose what a machine's model lacks from four of its drops; write JSON, reports and the extended machine file."""
    folder = shipped("loose")
    records = [read(path) for path in sorted(folder.glob("drop_*.nc"))]
    found = diagnose(load_machine(folder / "machine.toml"), records)
    _write(build_diagnosis_report(found, note=synthetic_note(len(records))), out, "diagnosis")
    write_json(out / "diagnosis.json", diagnosis_json(found))
    extended = extended_machine(found)
    if extended is not None:
        write_machine(extended, out / "extended.toml", extended_head(found))
    lines = [f"diagnosis: {out / 'diagnosis'}.html  {out / 'diagnosis'}.pdf  {out / 'diagnosis'}.json"]
    return lines + [f"  {line}" for line in diagnosis_lines(found)]


def _years(out: Path, progress: Progress) -> list[str]:
    """File ten drops of one machine, compare each with those before it, and report the last and the machine."""
    folder = shipped("years")
    archive = open_archive(out / "archive", create=True)
    orders = [Order(folder / "machine.toml", record, forces=True) for record in sorted(folder.glob("*.nc"))]
    progress(f"archive: analysing {len(orders)} drops and fitting their forces on {_WORKERS} processes")
    # again: results that an older version left in the folder are recomputed
    for done, outcome in enumerate(add_all(archive, orders, workers=_WORKERS, again=True), start=1):
        if outcome.failed:
            raise InputError(outcome.why)
        progress(f"archive: {done} of {len(orders)} drops filed")
    history = machine_history(archive, archive.machines()[0], progress)
    lines = [f"archive: {len(history.entries)} drops of {history.machine} in {archive.folder}"]
    for judged in history.judged:
        changed = ", ".join(change.title for change in judged.comparison.flagged)
        lines.append(f"  {judged.comparison.entry.raw_name}: {judged.verdict.word}{': ' + changed if changed else ''}")
    progress("archive: drawing the figures and writing the reports")
    last = history.last
    for name, document in (
        ("comparison", build_compare_report(last, history.standing_earlier)),
        ("machine", build_machine_report(history)),
    ):
        _write(document, out, name)
        lines.append(f"{name}: {out / name}.html  {out / name}.pdf")
    write_json(out / "comparison.json", comparison_json(last, history.standing_earlier))
    return lines


def _write(document: Document, out: Path, name: str) -> None:
    """Write a report in both forms."""
    write_html(document, out / f"{name}.html")
    write_pdf(document, out / f"{name}.pdf")
