"""A speed whose value stands for many samples: that of a slow tachometer or a controller, recorded at the logger's rate.

Each value is that at its update or before, by up to the time that it stands: samples between updates tell nothing.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.record.finding import Check
from tdbmon.record.held_values import changes, with_some_samples
from tdbmon.record.samples import times_of
from tdbmon.record.timebase import usual_interval

HELD = "held_s"  # attribute of a speed: how long each of its values stands, s
_LEAST = 3  # samples: a converter's steps in noise come one by one
_EARLY = 4096  # samples, that mostly show already that none is held
_SHORT = 0.1  # of the stretches are shorter than one that surely holds one update
_ONE = 1.5  # times that stretch: longer ones hold several updates to one value
_SAME = 1.01  # times the smallest change of value: all are steps of one converter


def speed_at_updates(ds: xr.Dataset) -> tuple[xr.Dataset, list[Check]]:
    """Return a record with each value of a held speed once, at the time at which it came, and a remark where it is held.

    It is then on a time base of its own, with the attribute `HELD`.
    """
    found = updates(ds["speed"].to_numpy()) if "speed" in ds else None
    if found is None:
        return ds, []
    at, length = found
    seconds = length * usual_interval(times_of(ds["speed"]))
    ds = with_some_samples(ds, "speed", at, f"{ds['speed'].dims[0]} of the speed's updates")
    ds["speed"].attrs[HELD] = seconds
    said = (
        f"every value stands {seconds:.3g} s: taken once each, at its update. It is the speed there or up to {seconds:.3g} s"
        " before, which intervals contain"
    )
    return ds, [Check("held values", "speed", True, said)]


def updates(values: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return the samples at which a held signal (n,) was updated, and for how many samples each value stands.

    An update to the same value is no change: a stretch that is longer than most is divided evenly, and the first, whose update
    may lie before the record, from its end.  A signal without noise that a coarse converter rounds has stretches too, but every
    change of it is one step of that: samples tell more of it than updates.

    Returns
    -------
    (m,) array of int and float, or None
        None where the values are not held.
    """
    known = np.isfinite(values)
    # what is missing is no other value
    values = values[np.maximum.accumulate(np.where(known, np.arange(values.size), 0))]
    if _shortest(values[:_EARLY]) < _LEAST:
        return None
    found = changes(values)
    if not found.size or _shortest(values) < _LEAST:
        return None
    first = np.concatenate([[0], found])
    lengths = np.diff(np.append(first, values.size))
    inner = lengths[1:-1] if lengths.size > 2 else np.array([lengths.max()])
    short = np.quantile(inner, _SHORT)
    usual = float(np.mean(inner[(inner > short / _ONE) & (inner < _ONE * short)]))
    count = np.maximum(np.rint(inner / usual), 1)
    steps = np.abs(np.diff(values[first]))
    steps = steps[np.isfinite(steps)]
    if not steps.size or steps.max() < _SAME * steps.min():
        return None
    before = np.arange(found[0] - usual, -0.5, -usual)[::-1]
    before = before if before.size else np.zeros(1)
    inside = [a + np.arange(n) * (length / n) for a, n, length in zip(first[1:-1], count, inner, strict=False)]
    after = np.arange(found[-1], values.size, usual)
    at = np.rint(np.concatenate([before, *inside, after])).astype(int)
    return np.unique(at[at < values.size]), usual


def _shortest(values: np.ndarray) -> int:
    """Return the shortest stretch of one value that begins and ends within a signal, in samples; all of it without one."""
    found = changes(values)
    return int(np.diff(found).min()) if found.size > 1 else values.size
