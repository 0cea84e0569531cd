"""Command `tdbmon analyse`: calls the library and writes the results; nothing is computed here."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse as run
from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.result import Analysis
from tdbmon.analysis.summary import summary_lines
from tdbmon.json_file import say, write_json
from tdbmon.machine_file import calibration_head, check_suffix, write_machine
from tdbmon.output_file import check_outputs
from tdbmon.progress import on_terminal
from tdbmon.record.read import read
from tdbmon.report_file import check_reports, draw_reports

if TYPE_CHECKING:
    from tdbmon.identify.fitted import FittedDrop
    from tdbmon.report.document import Document


def analyse(
    machine: Path,
    record: Path,
    json_file: Path | None,
    report: list[Path] | None,
    forces: bool,
    calibrated: Path | None,
    also: list[Path] | None,
) -> None:
    """Analyse a record, fit the simulation on request, and write the requested files."""
    check_reports(report)
    check_suffix(calibrated)
    check_outputs([json_file, *(report or []), calibrated], [machine, record, *(also or [])])
    with on_terminal() as tell:
        tell("reading the machine and the record")
        plan = load_machine(machine)
        channels = read(record)
        result = run(channels, plan, tell)
        fitted = None
        if forces or calibrated is not None or also:
            from tdbmon.identify.crew import all_cores
            from tdbmon.identify.fitted import fit_drop

            fitted = fit_drop(plan, channels, tell, [read(path) for path in also or []], all_cores()).beside(result)
            if report or json_file is not None:
                tell("continuing the simulation to the end of the record")
                fitted = fitted.with_coast_down(result)
    lines, written = list(summary_lines(result, fitted is not None)), []
    if fitted is not None:
        from tdbmon.identify.contract import force_lines

        lines += force_lines(fitted.calibration, fitted.forces)
        if calibrated is not None:
            from tdbmon.identify.measured_decay import with_measured_decay

            made, remark = with_measured_decay(fitted.calibration, result.rundown)
            write_machine(made, calibrated, calibration_head(fitted.calibration, machine, remark))
            written.append(f"machine: {calibrated}")
    if json_file is not None:
        written += write_json(json_file, _content(result, fitted))
    # before the figures, so that the results are not lost if one cannot be drawn
    say([*lines, *written])
    draw_reports(report, lambda _: _document(result, fitted))


def _document(result: Analysis, fitted: FittedDrop | None) -> Document:
    from tdbmon.report.drop_report import build_report

    return build_report(result, fitted=fitted)


def _content(result: Analysis, fitted: FittedDrop | None) -> dict[str, Any]:
    if fitted is None:
        return analysis_json(result)
    from tdbmon.identify.contract import with_fitted

    return with_fitted(analysis_json(result), fitted)
