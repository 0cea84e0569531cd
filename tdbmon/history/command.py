"""The commands `tdbmon archive` and `tdbmon compare`: they call the library and write results; nothing is computed here.

`tdbmon archive add` is in `tdbmon.history.adding`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from tdbsim.errors import InputError

from tdbmon.history.archive import Archive, open_archive
from tdbmon.history.catalogue import Entry
from tdbmon.json_file import say, write_json
from tdbmon.output_file import check_outputs
from tdbmon.progress import Progress, on_terminal
from tdbmon.quantity import counted, moment, printed
from tdbmon.report_file import check_reports, draw_reports

if TYPE_CHECKING:
    from tdbmon.history.fleet import Member
    from tdbmon.history.standing import Judged
    from tdbmon.report.document import Document


def list_drops(folder: Path, machine: str, json_file: Path | None) -> None:
    """List the drops in chronological order."""
    from tdbmon.history.contract import entry_json
    from tdbmon.history.matching import odd_clocks

    check_outputs([json_file], [])
    entries = open_archive(folder).entries(machine)
    written = write_json(json_file, {"drops": [entry_json(e) for e in entries]})
    if not entries:
        typer.echo(f"{folder}: no drops yet")
    of_machine: dict[str, list[Entry]] = {}
    for entry in entries:
        of_machine.setdefault(entry.machine, []).append(entry)
    for name, own in of_machine.items():
        odd = odd_clocks(own)
        typer.echo(f"{name}: {counted(len(own), 'drop')}")
        for entry in own:
            notes = [f"assembly {entry.assembly}"] if entry.assembly else []
            notes += [f"{counted(len(entry.failed_checks), 'check')} failed"] if entry.failed_checks else []
            notes += ["synthetic"] if entry.synthetic else []
            notes += ["clock!"] if entry.id in odd else []
            typer.echo(
                f"  {entry.id}  {entry.when:<34}{entry.speed_words:<14}{entry.raw_name:<24}{', '.join(notes)}".rstrip()
            )
    say(written)


def show(folder: Path, drop: str, json_file: Path | None) -> None:
    """Show one drop: its provenance and its features."""
    from tdbmon.history.contract import entry_json
    from tdbmon.history.feature import KINDS

    check_outputs([json_file], [])
    archive = open_archive(folder)
    entry = archive.entry(drop)
    filing = archive.filing(entry.id)
    rows = [
        {
            "name": f.name,
            "end": f.end,
            "title": KINDS[f.name].title if f.name in KINDS else f.name,
            **f.estimate.to_json(),
        }
        for f in filing.features
    ]
    content = {**entry_json(entry), "version": filing.version, "features": rows, "analysis": filing.analysis}
    written = write_json(json_file, content)
    typer.echo(f"{entry.id}  {entry.raw_name}  {entry.machine}")
    typer.echo(f"raw file: {archive.folder / entry.raw}")
    when = moment(entry.dropped) if entry.dropped else "not stated"
    typer.echo(f"dropped: {when}; filed: {moment(entry.filed)}; tdbmon {filing.version}")
    for feature in filing.features:
        if feature.estimate.known:
            typer.echo(f"  {feature.name:<28}{feature.end:<6}{printed(feature.estimate)}")
    missing = sorted({f.name for f in filing.features if not f.estimate.known})
    typer.echo(f"not estimated: {', '.join(missing) or 'nothing'}")
    say(written)


def verify(folder: Path, rebuild_it: bool, json_file: Path | None) -> None:
    """Verify the archive; raise `InputError` if there is a fault that filing again does not repair by itself."""
    from tdbmon.history import verify as check

    check_outputs([json_file], [])
    with on_terminal() as tell:
        archive = Archive(folder) if rebuild_it else open_archive(folder)
        archive.settings()
        faults = check.rebuild(archive, tell) if rebuild_it else []
        faults += [fault for fault in check.verify(archive, tell) if fault not in faults]
    wrong = [fault for fault in faults if not fault.harmless]
    rows = [{"file": f.file, "what": f.what, "harmless": f.harmless} for f in faults]
    written = write_json(json_file, {"sound": not wrong, "faults": rows})
    for fault in faults:
        typer.echo(f"{'note' if fault.harmless else 'FAULT'}: {fault.file}: {fault.what}")
    if not wrong:
        typer.echo(f"{folder}: sound, {counted(len(archive.entries()), 'drop')}")
    say(written)
    if wrong:
        raise InputError(f"{folder}: {counted(len(wrong), 'fault')} found ({wrong[0].file}: {wrong[0].what})")


def remove(folder: Path, drop: str) -> None:
    """Remove a drop with its raw file and results."""
    entry = open_archive(folder).remove(drop)
    typer.echo(f"removed {entry.id} ({entry.raw_name}) with its raw file and results")


def export(folder: Path, out: Path) -> None:
    """Write the features of all drops as a table."""
    from tdbmon.history.export import export as write

    check_outputs([out], [])
    rows = write(open_archive(folder), out)
    typer.echo(f"{rows} features: {out}")


def report(
    folder: Path,
    drop: str,
    machine: str,
    *,
    fail_on: str,
    json_file: Path | None,
    reports: list[Path],
) -> int:
    """Report one drop, one machine, or the fleet; return 3 if a machine has a standing alarm and `fail_on` is "alarm", else 0."""
    from tdbmon.history.contract import fleet_json
    from tdbmon.history.fleet import fleet
    from tdbmon.history.summary import fleet_lines

    check_reports(reports)
    check_outputs([json_file, *reports], [])
    _check_fail_on(fail_on)
    judging = bool(fail_on) or json_file is not None
    if drop and judging:
        raise InputError(
            "--drop reports one record, but --json and --fail-on apply to machines: leave --drop out, or use"
            f" tdbmon compare --archive {folder} {drop}"
        )
    if not reports and not judging:
        raise InputError("no --report file is given; write e.g. --report machine.html, or --json or --fail-on alarm")
    archive = open_archive(folder)
    names = archive.machines()
    if not names:
        raise InputError(f"{folder}: contains no drops yet; file some with 'tdbmon archive add'")
    machine = machine or (names[0] if len(names) == 1 else "")
    with on_terminal() as tell:
        members = fleet(archive, tell, machine) if judging or not (drop or machine) else []
    written = write_json(json_file, fleet_json(folder, members))
    say([*(fleet_lines(members) if judging else ()), *written])
    draw_reports(reports, partial(_document, archive, drop, machine, members))
    return 3 if fail_on == "alarm" and any(member.verdict.alarm for member in members) else 0


def _check_fail_on(fail_on: str) -> None:
    if fail_on not in ("", "alarm"):
        raise InputError(f"--fail-on '{fail_on}': is unknown; write --fail-on alarm")


def _document(archive: Archive, drop: str, machine: str, members: list[Member], tell: Progress) -> Document:
    """Return the report of a drop if one is named, else of a machine, else of the fleet."""
    from tdbmon.history.machine_history import machine_history
    from tdbmon.report.fleet_report import build_fleet_report
    from tdbmon.report.machine_report import build_machine_report

    if drop:
        return _drop_document(archive, drop, tell)
    if machine:
        return build_machine_report(machine_history(archive, machine, tell))
    return build_fleet_report(members)


def _drop_document(archive: Archive, drop: str, tell: Progress) -> Document:
    """Return the report of a filed drop, by a new analysis of its raw file."""
    from tdbsim.machine import load_machine

    from tdbmon.analysis.analyse import analyse
    from tdbmon.record.read import read
    from tdbmon.report.drop_report import build_report

    entry = archive.entry(drop)
    raw = archive.folder / entry.raw
    if not raw.exists():
        raise InputError(
            f"{raw}: the raw file of drop {entry.id} is missing; restore it by adding {entry.raw_name} again"
        )
    record = read(raw)
    record.attrs["source_file"] = entry.raw_name
    return build_report(analyse(record, load_machine(archive.machine_file(entry.id)), tell))


def compare(
    folder: Path,
    drop: str,
    *,
    machine: Path | None,
    forces: bool,
    fail_on: str,
    json_file: Path | None,
    reports: list[Path],
) -> int:
    """Compare a filed drop, or a record, with earlier drops; return 3 if an alarm stands and `fail_on` is "alarm", else 0."""
    from tdbmon.history.compare import compare as run
    from tdbmon.history.contract import comparison_json
    from tdbmon.history.standing import Judged, standing_beside
    from tdbmon.history.summary import comparison_lines
    from tdbmon.history.unfiled import drop_to_compare

    check_reports(reports)
    check_outputs([json_file, *reports], [machine, Path(drop) if drop else None])
    _check_fail_on(fail_on)
    with on_terminal() as tell:
        archive = open_archive(folder)
        tell("reading the drop")
        judged = Judged(run(archive, drop_to_compare(archive, drop, machine, forces, tell)))
        standing = standing_beside(archive, judged)
    written = write_json(json_file, comparison_json(judged, standing))
    say([*comparison_lines(judged, standing), *written])
    draw_reports(reports, lambda _: _comparison_document(judged, standing))
    return 3 if fail_on == "alarm" and (judged.verdict.alarm or standing) else 0


def _comparison_document(judged: Judged, standing: Sequence[Judged]) -> Document:
    from tdbmon.report.compare_report import build_compare_report

    return build_compare_report(judged, standing)
