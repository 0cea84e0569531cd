"""Detection of duplicates: a drop exported twice, say as CSV and TDMS, must not count twice.

Formats round, so that no digest of a file or of its samples identifies a drop.  Filed drops with nearly equal features are
suspects, and their samples decide.  All drops of the machine are suspects if the record may lack the start of its drop.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from tdbsim.errors import InputError

from tdbmon.history import catalogue
from tdbmon.history.catalogue import Entry
from tdbmon.history.feature import Feature, Key
from tdbmon.history.filing import Filing
from tdbmon.record.same_samples import same_samples

if TYPE_CHECKING:
    import xarray as xr
    from tdbsim.machine import Machine

    from tdbmon.history.archive import Archive

_EQUAL = 1e-12  # relative: two drops of one machine never agree to this in all features
_NEAR = 3e-3  # relative: the speed and half of the features of two exports; of two drops half differ by 1 % and more
_LEAST = 5  # features needed to identify a drop
_SECOND = 1.0  # s: formats round the time of a drop
# failed checks of a record that may start in the middle of its drop: it shows no release, or takes a bounce for it.  Of the
# record, and of a channel or end that is named after them; "dropout NDE_A" is another check
_NO_RELEASE = ("levitated stretch", "drop")
_NO_SOUND_RELEASE = ("free fall ", "set point ")


def twin_of(
    archive: Archive, base: sqlite3.Connection, filing: Filing, record: Callable[[], xr.Dataset]
) -> Entry | None:
    """Return the filed drop that a record is another file of, or None.

    Parameters
    ----------
    archive : Archive
    base : sqlite3.Connection
        Its catalogue.
    filing : Filing
        Results of the record.
    record : callable
        Returns the record assigned to its machine; called only if there is a suspect.
    """
    samples = None
    for entry, sure in _suspects(base, filing):
        if sure:
            return entry
        filed = _filed(archive, entry)
        if filed is None:
            continue
        samples = record() if samples is None else samples
        if same_samples(samples, filed):
            return entry
    return None


def _suspects(base: sqlite3.Connection, filing: Filing) -> Iterator[tuple[Entry, bool]]:
    """Yield the filed drops that a record may duplicate, the likely ones first, and whether all features are equal."""
    mine = _numbers(filing.features)
    speed = mine.get(("initial_hz", ""))
    if speed is None:  # one export may hold the speed and another not
        near = catalogue.entries(base, "machine = ?", (filing.machine,))
    else:
        limits = (filing.machine, speed * (1 - _NEAR), speed * (1 + _NEAR))
        near = catalogue.entries(base, "machine = ? AND (speed_hz IS NULL OR speed_hz BETWEEN ? AND ?)", limits)
    found = catalogue.features(base, [entry.result for entry in near])
    alike = set()
    for entry in near:
        theirs = _numbers(found[entry.result])
        apart = np.array([_apart(mine[key], theirs[key]) for key in mine if key in theirs])
        if len(apart) >= _LEAST and np.median(apart) <= _NEAR:
            alike.add(entry.id)
            yield entry, bool(apart.max() <= _EQUAL)
    for entry in catalogue.entries(base, "machine = ?", (filing.machine,)):
        late = _starts_late(filing.failed_checks) or _starts_late(entry.failed_checks)
        if late and entry.id not in alike:
            yield entry, False


def _starts_late(failed_checks: tuple[str, ...]) -> bool:
    return any(each in _NO_RELEASE or each.startswith(_NO_SOUND_RELEASE) for each in failed_checks)


def at_same_instant(base: sqlite3.Connection, filing: Filing) -> Entry | None:
    """Return the filed drop of the same machine, instant and speed, or None: a machine drops at most once a second.

    Its samples differ, so that it is no plain copy: a channel was changed, or a clock had stopped.
    """
    when = catalogue.instant(filing.dropped)
    if when is None:  # a date alone may be that of several drops
        return None
    limits = (filing.machine, when - _SECOND, when + _SECOND)
    near = catalogue.entries(base, "machine = ? AND moment > ? AND moment < ?", limits)
    speed = catalogue.speed_of(filing.features)
    return next((e for e in near if catalogue.instant(e.dropped) is not None and _one_speed(speed, e.speed)), None)


def _one_speed(one: float | None, other: float | None) -> bool:
    return one is None or other is None or _apart(one, other) <= _NEAR


def _numbers(features: Iterable[Feature]) -> dict[Key, float]:
    return {f.key: f.estimate.value for f in features if f.estimate.value is not None}


def _apart(one: float, other: float) -> float:
    """Return the relative difference of two values."""
    return abs(one - other) / max(abs(one), abs(other), 1e-300)


def laid(record: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a record assigned to its machine, probes named by their direction: two exports may name them differently."""
    from tdbmon.record.assign import assign

    places = {
        probe.name: f"{1e3 * probe.position:.1f} mm, {math.degrees(probe.angle) % 360:.1f} deg"
        for probe in machine.probes
    }
    found = assign(record, machine)
    return found.rename({name: place for name, place in places.items() if name in found})


def read_and_laid(raw: Path, machine: Path) -> xr.Dataset:
    """Return the record of a raw file assigned to the machine of a machine file."""
    from tdbsim.machine import load_machine

    from tdbmon.record.read import read

    return laid(read(raw), load_machine(machine))


def _filed(archive: Archive, entry: Entry) -> xr.Dataset | None:
    """Return the record of a filed drop, or None if it cannot be read (the package for its format may be missing)."""
    try:
        return read_and_laid(archive.folder / entry.raw, archive.machine_file(entry.id))
    except InputError:
        return None
