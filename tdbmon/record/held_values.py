"""Probes sampled more slowly than the table that they were written into: every value stands several times.

Held values look like flat tops and dropouts, and date what happens half a step late.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from tdbmon.record.finding import Check
from tdbmon.record.one_time import Series
from tdbmon.record.timebase import usual_rate

_FEWEST = 50  # changes of value, by which it is told
_EARLY = 4096  # samples, that mostly show already that none is held
_MOST_STEPS = 0.5  # of all steps, that change the value: fewer are those of a coarse converter


def at_own_rates(data: Series, times: Series, probes: Sequence[str]) -> tuple[Series, Series, list[Check]]:
    """Return channels with each held value of a probe once, at the time at which it came, and what was held.

    Parameters
    ----------
    data : dict of DataArray
        Channels by their machine name, each along one dimension.
    times : dict of DataArray
        Time along each of these dimensions, s.
    probes : sequence of str
        Those of the channels that are probes.

    Returns
    -------
    data, times : dict of DataArray
        Held probes on dimensions of their own.
    remarks : list of Check
        One a held probe.
    """
    data, times = dict(data), dict(times)
    remarks: list[Check] = []
    for name in probes:
        array = data[name]
        dim = str(array.dims[0])
        first, times_held = held(array.to_numpy())
        if times_held == 1:
            continue
        own, once = f"{dim} from {first} by {times_held}", slice(first, None, times_held)
        if own not in times:
            times[own] = picked(times[dim], own, once)
        data[name] = picked(array, own, once)
        hz = usual_rate(times[own].to_numpy())
        remarks.append(
            Check("held values", name, True, f"every value stands {times_held} times: taken once each, at {hz:.5g} Hz")
        )
    return data, times, remarks


def picked(array: xr.DataArray, own: str, once: slice | np.ndarray) -> xr.DataArray:
    """Return some samples of a channel (n,), on a dimension of their own."""
    taken = xr.DataArray(array.to_numpy()[once], dims=(own,), attrs=array.attrs)
    taken.encoding = dict(array.encoding)
    return taken


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
