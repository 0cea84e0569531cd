"""`tdbmon archive add`: files records and reports the outcome and remarks of each."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

import typer
from tdbsim.errors import InputError

from tdbmon.history.archive import Archive, open_archive
from tdbmon.history.batch import Outcome, add_all
from tdbmon.history.catalogue import Entry
from tdbmon.history.filing import Filing
from tdbmon.history.matching import assembly_remarks, clock_remarks, counts, doubts
from tdbmon.history.study import Order
from tdbmon.json_file import say, write_json
from tdbmon.output_file import check_outputs
from tdbmon.progress import on_terminal
from tdbmon.quantity import counted
from tdbmon.record.quality import same_name


def add(
    folder: Path,
    machine: Path,
    records: list[Path],
    *,
    forces: bool | None,
    assembly: str,
    dropped: str,
    again: bool,
    workers: int,
    scheduler: str,
    json_file: Path | None,
) -> int:
    """Study and file records; return the exit code: 2 if any failed, each reported on standard error."""
    from tdbsim.machine import load_machine

    check_outputs([json_file], [machine, *records])
    if dropped:
        _check_time(dropped, len(records))
    load_machine(machine)
    archive = open_archive(folder, create=True)
    orders = [Order(machine, record, forces=forces, assembly=assembly, dropped=dropped) for record in records]
    outcomes = []
    with on_terminal() as tell:
        for outcome in add_all(archive, orders, workers, scheduler, tell, again):
            outcomes.append(outcome)
            if not outcome.failed:
                typer.echo(f"{outcome.drop}  {outcome.state:<16}{outcome.record.name}")
    for line in _failures(outcomes):
        _warn(line)
    of_machine = cache(archive.entries)
    rows = []
    for outcome in outcomes:
        remarks = _remarks(archive, outcome, machine, assembly, of_machine)
        for remark in remarks:
            _warn(f"{outcome.record.name}: {remark}")
        rows.append(_row(archive, outcome, remarks))
    filed = {archive.entry(o.drop).machine for o in outcomes if o.state == "filed"}
    names = _written_otherwise(archive, filed)
    for line in names:
        _warn(line)
    for line in _passed_over(outcomes):
        typer.echo(line)
    failed = [o for o in outcomes if o.failed]
    typer.echo(f"{len(outcomes) - len(failed)} of {len(outcomes)} records are in {folder}")
    say(write_json(json_file, {"archive": str(folder), "records": rows, "remarks": names}))
    return 2 if failed else 0


def _row(archive: Archive, outcome: Outcome, remarks: list[str]) -> dict[str, Any]:
    """Return a record's part of the JSON; fields on its checks are null if it is not filed."""
    entry = archive.entry(outcome.drop) if outcome.drop and not outcome.failed else None
    return {
        "file": str(outcome.record),
        "drop": outcome.drop or None,
        "state": outcome.state,
        "why": outcome.why,
        "remark": "; ".join(remarks),
        "remarks": remarks,
        "failed_checks": None if entry is None else list(entry.failed_checks),
        "reference": None if entry is None else not doubts(entry.failed_checks),
        "counted": None if entry is None else counts(entry),
        "otherwise": list(outcome.otherwise),
        "lost": list(outcome.lost),
    }


def _remarks(
    archive: Archive, outcome: Outcome, machine: Path, assembly: str, of_machine: Callable[[str], list[Entry]]
) -> list[str]:
    """Return the remarks on a record that was filed or analysed again."""
    if outcome.state not in ("filed", "analysed again"):
        return []
    entry, filing = archive.entry(outcome.drop), archive.filing(outcome.drop)
    again = f"tdbmon archive add --again --archive {archive.folder}"
    found = []
    if outcome.lost:
        before = f"{archive.folder}/machines/{outcome.machine_before}.toml"
        cure = f"; to use it again: {again} {before} {outcome.record}" if outcome.machine_before else ""
        found.append(
            f"unlike the previous result, the new one lacks: {'; '.join(outcome.lost)}; the previous result is kept, but no"
            f" longer used{cure}"
        )
    if version := archive.forces_before(entry):
        found.append(
            f"its result with forces, by tdbmon {version}, is kept but no longer used: comparisons and reports show no stresses"
            f" of this drop; to restore them: {again} --forces {machine} {outcome.record}"
        )
    if entry.failed_checks:
        effect = "; no drop is compared with it" if doubts(entry.failed_checks) else ""
        effect += "" if counts(entry) else ", nor does it count as a drop of the machine"
        found.append(f"checks failed: {', '.join(entry.failed_checks)}{effect}")
    if outcome.state == "filed":
        found += [filing.unread_date] if filing.unread_date and not entry.dropped else []
        found += clock_remarks(entry, of_machine(entry.machine))
        found += [] if assembly else assembly_remarks(entry, of_machine(entry.machine))
    return found + _strangers(archive, outcome.drop, filing)


def _failures(outcomes: list[Outcome]) -> list[str]:
    """Return one line per reason of failure: records stamped by a stopped clock, say, all fail for the same one."""
    of: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        if outcome.failed:
            of.setdefault(outcome.why.removeprefix(f"{outcome.record}: "), []).append(outcome)
    lines = [
        own[0].why if len(own) == 1 else f"each of {', '.join(o.record.name for o in own)}: {why}"
        for why, own in of.items()
    ]
    return [" ".join(line.split()) for line in lines]


def _passed_over(outcomes: list[Outcome]) -> list[str]:
    """Return a line on filed drops that were not analysed again although their version or machine file differs."""
    reasons = [reason for outcome in outcomes for reason in outcome.otherwise]
    if not reasons:
        return []
    told = [f"{counted(reasons.count(reason), 'drop')} {reason}" for reason in dict.fromkeys(reasons)]
    return [f"already filed, so not analysed again: analysed {', '.join(told)}; use --again to analyse them again"]


def _check_time(dropped: str, records: int) -> None:
    try:
        datetime.fromisoformat(dropped)
    except ValueError:
        raise InputError(f"--dropped '{dropped}': is not an ISO 8601 time; write e.g. 2026-03-11T09:00:00Z") from None
    if records > 1:
        raise InputError(f"--dropped is the time of one drop, but {records} records are given: add them one by one")


def _warn(line: str) -> None:
    sys.stderr.write(f"tdbmon: {line}\n")


def _strangers(archive: Archive, drop: str, filing: Filing) -> list[str]:
    """Return a remark on a record without a drop, or of another machine by its name or features."""
    from tdbmon.history.another_machine import likeness

    found = likeness(archive, archive.entry(drop), filing.features)
    sentences = [said for said in (filing.no_drop, filing.foreign) if said]
    sentences += [found.sentence] if found.strange else []
    if not sentences:
        return []
    return ["; ".join([*sentences, f"to remove it: tdbmon archive remove --archive {archive.folder} {drop}"])]


def _written_otherwise(archive: Archive, machines: Iterable[str]) -> list[str]:
    """Return remarks on machines whose names differ from others in the archive only in case or blanks: perhaps one machine."""
    return [
        f"machine '{name}': drops of '{other}' are also filed and are not compared with those of '{name}'; if both are the same"
        " machine, use one name in the machine files, remove the drops with the wrong name and add them again"
        for name in sorted(machines)
        for other in archive.machines()
        if other != name and same_name(other, name)
    ]
