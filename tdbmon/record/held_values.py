"""Sample-and-hold probe signals: probes sampled more slowly than the table they were exported to, with repeated values.

Held values look like clipped peaks and dropouts, and delay all events by half a hold length.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from tdbmon.record.finding import Check
from tdbmon.record.timebase import usual_rate

_FEWEST = 50  # changes of value needed for a decision
_EARLY = 4096  # first samples, mostly sufficient to see that no value is held
_MOST_STEPS = 0.5  # least fraction of holds that end with a change of value: fewer indicate coarse quantisation


def at_own_rates(ds: xr.Dataset, probes: Sequence[str]) -> tuple[xr.Dataset, list[Check]]:
    """Return a record with held probe signals reduced to one sample per hold, and a remark for each such probe."""
    remarks: list[Check] = []
    for name in probes:
        first, times_held = held(ds[name].to_numpy())
        if times_held == 1:
            continue
        own = f"{ds[name].dims[0]} from {first} by {times_held}"
        ds = with_some_samples(ds, name, slice(first, None, times_held), own)
        hz = usual_rate(ds[own].to_numpy())
        remarks.append(
            Check("held values", name, True, f"every value is held for {times_held} samples: one is used, at {hz:.5g} Hz")
        )
    return ds, remarks


def with_some_samples(ds: xr.Dataset, name: str, once: slice | np.ndarray, own: str) -> xr.Dataset:
    """Return a record with a channel reduced to the samples `once`, on a separate time base named `own`."""
    array = ds[name]
    time = ds[array.dims[0]]
    taken = xr.Variable(own, array.to_numpy()[once], array.attrs, array.encoding)
    return ds.assign_coords({own: (own, time.to_numpy()[once], time.attrs)}).assign({name: taken})


def held(values: np.ndarray) -> tuple[int, int]:
    """Return the index of the first complete hold of a signal (n,), and the hold length in samples; 1 if not held."""
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
    """Return the indices of samples that differ from the previous sample, both being finite."""
    known = np.isfinite(values)
    return np.flatnonzero((np.diff(values) != 0) & known[1:] & known[:-1]) + 1
