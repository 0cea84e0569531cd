"""Another file of a measurement that is filed: the same drop exported twice, say as CSV and TDMS, must not count twice.

Formats round: no digest of a file or of its samples survives that.  Drops of about the same features are suspected, and
their samples decide.  So may be all drops of the machine, where a record may be the rest of one whose start was cut away.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from tdbsim.errors import InputError

from tdbmon.history import catalogue
from tdbmon.history.catalogue import Entry
from tdbmon.history.filing import Filing

if TYPE_CHECKING:
    import xarray as xr

    from tdbmon.history.archive import Archive

_EQUAL = 1e-12  # relative: two drops of one machine never agree to this in everything
_NEAR = 3e-3  # relative: the speed and half of the features of two exports; of two drops half differ by 1 % and more
_LEAST = 5  # features that tell drops apart
_ROUNDING = 1e-3  # of a probe's standard deviation: so little are two exports of its samples apart
_SECOND = 1.0  # s: formats round the time of a drop
_CUT = 0.9  # of the samples, that the shorter of two exports must hold to be compared from their first samples on
_LEAST_SAMPLES = 100  # that tell where a cut record lies in another
_CHANGE = 0.3  # of the change from sample to sample: noise of two drops at rest is apart by all of it
# failed checks of a record that may start in the middle of its drop: it shows no release, or takes a bounce for it
_STARTS_LATE = ("levitated stretch", "free fall", "set point", "drop")


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
        if _same_samples(samples, filed):
            return entry
    return None


def _suspects(base: sqlite3.Connection, filing: Filing) -> Iterator[tuple[Entry, bool]]:
    """Yield the drops that a record may be another file of, the likely ones first, and whether all features are equal."""
    mine = _numbers(filing)
    speed = mine.get(("initial_hz", ""))
    if speed is None:
        near = catalogue.entries(base, "machine = ? AND speed_hz IS NULL", (filing.machine,))
    else:
        limits = (filing.machine, speed * (1 - _NEAR), speed * (1 + _NEAR))
        near = catalogue.entries(base, "machine = ? AND speed_hz BETWEEN ? AND ?", limits)
    found = catalogue.features(base, [entry.result for entry in near])
    alike = set()
    for entry in near:
        theirs = {(f.name, f.end): f.estimate.value for f in found[entry.result] if f.estimate.value is not None}
        apart = np.array([_apart(mine[key], theirs[key]) for key in mine if key in theirs])
        if len(apart) >= _LEAST and np.median(apart) <= _NEAR:
            alike.add(entry.id)
            yield entry, bool(apart.max() <= _EQUAL)
    for entry in catalogue.entries(base, "machine = ?", (filing.machine,)):
        late = _starts_late(filing.failed_checks) or _starts_late(entry.failed_checks)
        if late and entry.id not in alike:
            yield entry, False


def _starts_late(failed_checks: tuple[str, ...]) -> bool:
    return any(each.startswith(_STARTS_LATE) for each in failed_checks)


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


def _numbers(filing: Filing) -> dict[tuple[str, str], float]:
    return {(f.name, f.end): f.estimate.value for f in filing.features if f.estimate.value is not None}


def _apart(one: float, other: float) -> float:
    """Relative difference."""
    return abs(one - other) / max(abs(one), abs(other), 1e-300)


def laid(raw: Path, machine: Path) -> xr.Dataset:
    """Return the record of a file laid over the machine of another."""
    from tdbsim.machine import load_machine

    from tdbmon.record.assign import assign
    from tdbmon.record.read import read

    return assign(read(raw), load_machine(machine))


def _filed(archive: Archive, entry: Entry) -> xr.Dataset | None:
    """Return the record of a filed drop, or None where it cannot be read (its format's package is missing here, say)."""
    try:
        return laid(archive.folder / entry.raw, archive.machine_file(entry.id))
    except InputError:
        return None


def _same_samples(one: xr.Dataset, other: xr.Dataset) -> bool:
    """Return whether the displacements of two records are the same but for rounding and what was cut off at start and end."""
    names = [name for name in one.data_vars if name in other and one[name].attrs.get("units") == "m"]
    pairs = [(one[name].to_numpy(), other[name].to_numpy()) for name in names]
    return bool(pairs) and (all(_same(a, b) for a, b in pairs) or _share_a_stretch(pairs))


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    size = min(a.size, b.size)
    if size < _CUT * max(a.size, b.size):
        return False
    apart, spread = a[:size] - b[:size], float(np.nanstd(a)) if np.isfinite(a).any() else 0.0
    seen = np.isfinite(apart)
    return not seen.any() or float(np.sqrt(np.mean(apart[seen] ** 2))) <= _ROUNDING * spread


def _share_a_stretch(pairs: list[tuple[np.ndarray, np.ndarray]]) -> bool:
    """Return whether half of the shorter record at least lies in the other, in all channels."""
    tells = False
    for a, b in pairs:
        longer, shorter = (a, b) if a.size >= b.size else (b, a)
        if shorter.size < 2 * _LEAST_SAMPLES or not (np.isfinite(a).any() and np.isfinite(b).any()):
            return False
        changes = [_change_in_common(longer, shorter, start) for start in (0, shorter.size // 2)]
        known = [change for change in changes if change is not None]
        if not known:
            return False
        tells |= any(known)
    return tells  # a stretch in which no probe moves could be of any drop


def _change_in_common(longer: np.ndarray, shorter: np.ndarray, start: int) -> float | None:
    """Return the change from sample to sample where two records overlap, m (rms); None where they differ there.

    They are laid so that the half of the shorter one from `start` on fits best.
    """
    place = _best_place(longer, shorter[start : start + shorter.size // 2]) - start
    first, last = max(place, 0), min(place + shorter.size, longer.size)
    common = longer[first:last]
    apart = common - shorter[first - place : last - place]
    seen = np.isfinite(apart)
    if not seen.any():
        return None
    change = float(np.sqrt(np.nanmean(np.diff(common[seen]) ** 2))) if seen.sum() > 1 else 0.0
    limit = min(_ROUNDING * float(np.nanstd(longer)), _CHANGE * change)
    return change if float(np.sqrt(np.mean(apart[seen] ** 2))) <= limit else None


def _best_place(longer: np.ndarray, part: np.ndarray) -> int:
    """Return the sample of a channel from which on a part differs least from it, by the sum of squares."""
    from scipy.signal import correlate

    middle = float(np.nanmean(longer))
    x, y = np.nan_to_num(longer - middle), np.nan_to_num(part - middle)
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    return int(np.argmin(squares[y.size :] - squares[: -y.size] - 2 * correlate(x, y, mode="valid", method="fft")))
