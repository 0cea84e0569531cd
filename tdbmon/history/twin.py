"""Another file of a measurement that is filed: the same drop exported twice, say as CSV and TDMS, must not count twice.

Formats round: no digest of a file or of its samples survives that.  Drops of about the same features are suspected, and
their samples decide.  So may be all drops of the machine, where a record may be the rest of one whose start was cut away.
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

_EQUAL = 1e-12  # relative: two drops of one machine never agree to this in everything
_NEAR = 3e-3  # relative: the speed and half of the features of two exports; of two drops half differ by 1 % and more
_LEAST = 5  # features that tell drops apart
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
        What was found in the record.
    record : callable
        Gives the record laid over its machine; asked only where a filed drop is suspected.
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
    """Yield the drops that a record may be another file of, the likely ones first, and whether all features are equal."""
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
    """Return the filed drop of the same machine, time of day and speed, or None: one machine drops once in a second.

    Its samples differ, so it is no mere copy: one channel of it was changed, or a clock stood still.
    """
    when = catalogue.instant(filing.dropped)
    if when is None:  # a day alone is that of several drops
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
    """Relative difference."""
    return abs(one - other) / max(abs(one), abs(other), 1e-300)


def laid(record: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a record laid over its machine, its probes named by where they look: two exports may name them otherwise."""
    from tdbmon.record.assign import assign

    places = {
        probe.name: f"{1e3 * probe.position:.1f} mm, {math.degrees(probe.angle) % 360:.1f} deg"
        for probe in machine.probes
    }
    found = assign(record, machine)
    return found.rename({name: place for name, place in places.items() if name in found})


def read_and_laid(raw: Path, machine: Path) -> xr.Dataset:
    """Return the record of a file laid over the machine of another."""
    from tdbsim.machine import load_machine

    from tdbmon.record.read import read

    return laid(read(raw), load_machine(machine))


def _filed(archive: Archive, entry: Entry) -> xr.Dataset | None:
    """Return the record of a filed drop, or None where it cannot be read (its format's package is missing here, say)."""
    try:
        return read_and_laid(archive.folder / entry.raw, archive.machine_file(entry.id))
    except InputError:
        return None
