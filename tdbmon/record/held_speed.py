"""Sample-and-hold speed signals: a slow tachometer or controller output, recorded at the logger's higher rate.

Each value is the speed at its update or up to one hold time earlier; samples between updates carry no information.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.record.finding import Check
from tdbmon.record.held_values import changes, with_some_samples
from tdbmon.record.samples import times_of
from tdbmon.record.timebase import usual_interval

HELD = "held_s"  # attribute of a speed: its hold time, s
_LEAST = 3  # samples: shorter holds are quantised noise
_EARLY = 4096  # first samples, mostly sufficient to see that no value is held
_SHORT = 0.1  # quantile of the hold lengths taken as a single update
_ONE = 1.5  # times that length: longer holds contain several updates to the same value
_SAME = 1.01  # times the smallest change: if no change is larger, all are single steps of a converter


def speed_at_updates(ds: xr.Dataset) -> tuple[xr.Dataset, list[Check]]:
    """Return a record with a held speed reduced to its updates, and a remark; unchanged and no remark if not held.

    The reduced speed has a time base of its own and the attribute `HELD`.
    """
    found = updates(ds["speed"].to_numpy()) if "speed" in ds else None
    if found is None:
        return ds, []
    at, length = found
    seconds = length * usual_interval(times_of(ds["speed"]))
    ds = with_some_samples(ds, "speed", at, f"{ds['speed'].dims[0]} of the speed's updates")
    ds["speed"].attrs[HELD] = seconds
    said = (
        f"every value is held for {seconds:.3g} s: only the sample at its update is used. It is the speed then or up to"
        f" {seconds:.3g} s earlier; confidence intervals include this delay"
    )
    return ds, [Check("held values", "speed", True, said)]


def updates(values: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return the indices at which a held signal (n,) was updated, and the hold length in samples.

    Updates to the same value are invisible: a longer hold is divided evenly, and the first one, whose update may precede the
    record, is divided backwards from its end.  A noise-free signal with coarse quantisation also has constant stretches, but
    each of its changes is one quantum; it is not treated as held, as its samples contain more information than its updates.

    Returns
    -------
    (m,) array of int and float, or None
        Update indices and hold length; None if the values are not held.
    """
    known = np.isfinite(values)
    # a missing sample is not a change: fill forward
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
    """Return the shortest hold that begins and ends within a signal, in samples; the signal's length if there is none."""
    found = changes(values)
    return int(np.diff(found).min()) if found.size > 1 else values.size
