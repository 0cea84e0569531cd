"""Probes sampled more slowly than the table that they were written into: every value stands several times.

Held values look like flat tops and dropouts, and date what happens half a step late.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from tdbmon.record.finding import Check
from tdbmon.record.timebase import usual_rate

_FEWEST = 50  # changes of value, by which it is told
_EARLY = 4096  # samples, that mostly show already that none is held
_MOST_STEPS = 0.5  # of all steps, that change the value: fewer are those of a coarse converter


def at_own_rates(ds: xr.Dataset, probes: Sequence[str]) -> tuple[xr.Dataset, list[Check]]:
    """Return a record with each held value of its probes once, at the time at which it came, and a remark on each held probe."""
    remarks: list[Check] = []
    for name in probes:
        first, times_held = held(ds[name].to_numpy())
        if times_held == 1:
            continue
        own = f"{ds[name].dims[0]} from {first} by {times_held}"
        ds = with_some_samples(ds, name, slice(first, None, times_held), own)
        hz = usual_rate(ds[own].to_numpy())
        remarks.append(
            Check("held values", name, True, f"every value stands {times_held} times: taken once each, at {hz:.5g} Hz")
        )
    return ds, remarks


def with_some_samples(ds: xr.Dataset, name: str, once: slice | np.ndarray, own: str) -> xr.Dataset:
    """Return a record with some samples of a channel only, on a time base `own`."""
    array = ds[name]
    time = ds[array.dims[0]]
    taken = xr.Variable(own, array.to_numpy()[once], array.attrs, array.encoding)
    return ds.assign_coords({own: (own, time.to_numpy()[once], time.attrs)}).assign({name: taken})


def held(values: np.ndarray) -> tuple[int, int]:
    """Return where the first whole step of a signal (n,) begins, and how many samples each step lasts; 1 where none is held."""
    early = changes(values[:_EARLY])
    if early.size > 2 and np.gcd.reduce(np.diff(early)) == 1:
        return 0, 1
    found = changes(values)
    if found.size < _FEWEST:
        return 0, 1
    length = int(np.gcd.reduce(np.diff(found)))
    if length == 1 or found.size < _MOST_STEPS * (found[-1] - found[0]) / length:
        return 0, 1
    return int(found[0] % length), length


def changes(values: np.ndarray) -> np.ndarray:
    """Return the samples whose value is another than the one before, both known."""
    known = np.isfinite(values)
    return np.flatnonzero((np.diff(values) != 0) & known[1:] & known[:-1]) + 1
