"""Clock jumps: gaps in the time axis during which no real time passed, because only the logger's clock jumped.

A pause of the logger leaves the same gap.  The deceleration of the rotor distinguishes the two: after a pause the rotor is
slower, after a clock jump its speed continues without a step.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import Check
from tdbmon.record.keyphasor import pulses
from tdbmon.record.samples import known_samples, times_of
from tdbmon.record.timebase import usual_interval

_HOLE = 10  # intervals: in a shorter gap the rotor does not slow noticeably
_SIDE_S = 1.0  # on either side of a gap, used to fit the speed across it
_BLOCKS = 20  # block means per side
_FEWEST = 5
_TOLD = 6.0  # standard deviations: the speed loss expected in a pause must exceed this to be detectable
_NONE = 3.0  # standard deviations, or
_SHARE = 0.05  # of the expected speed loss: a smaller speed step counts as none


def without_clock_jumps(record: xr.Dataset, machine: Machine) -> tuple[xr.Dataset, list[Check]]:
    """Return a record with its clock jumps removed, and a failed check for each jump.

    Gaps in which the rotor slowed, or for which the speed is inconclusive, are kept.
    """
    found = _jumps(record, machine)
    checks: list[Check] = []
    for after, length in reversed(found):  # from last to first, so that times before a jump are still those of the file
        detail = (
            f"the clock jumps by {length:.4g} s at {after - length:.5g} s, but the rotor continues at a speed as if no time had"
            " passed: the jump is removed, and later times are smaller by it than in the file"
        )
        checks.insert(0, Check("clock", "time", False, detail))
        record = record.assign_coords(
            {dim: record[dim].copy(data=_closed(record[dim].to_numpy(), after, length)) for dim in record.dims}
        )
    return record, checks


def _closed(time: np.ndarray, after: float, length: float) -> np.ndarray:
    """Return times (n,) with a jump removed, or unchanged if this time axis has no gap there."""
    first = int(np.searchsorted(time, after - 0.5 * length))
    if not 0 < first < len(time) or time[first] - time[first - 1] - usual_interval(time) < 0.9 * length:
        return time
    return np.where(np.arange(len(time)) >= first, time - length, time)


def _jumps(record: xr.Dataset, machine: Machine) -> list[tuple[float, float]]:
    """Return the time after each jump and its length, s."""
    name = next((each for each in ("speed", "keyphasor") if each in record), None)
    if name is None:
        return []
    time = times_of(record[name])
    if len(time) < 2 * _FEWEST:
        return []
    interval = usual_interval(time)
    holes = np.flatnonzero(np.diff(time) > _HOLE * interval)
    if not holes.size:
        return []
    if name == "speed":
        begin, hz = known_samples(record["speed"])
        end = begin
    else:
        key = pulses(record, machine)
        begin, end, hz = key.times[:-1], key.times[1:], np.diff(key.turns) / np.diff(key.times)
    edges = np.concatenate([time[:1], np.column_stack([time[holes], time[holes + 1]]).ravel(), time[-1:]])
    found = []
    for k, hole in enumerate(holes):
        length = float(time[hole + 1] - time[hole] - interval)
        first, last = (max(edges[2 * k], time[hole] - _SIDE_S), min(edges[2 * k + 3], time[hole + 1] + _SIDE_S))
        sides = [(begin >= first) & (end <= time[hole]), (begin >= time[hole + 1]) & (end <= last)]
        at = 0.5 * (begin + end) - time[hole]
        before, after = (_means(at[side], hz[side]) for side in sides)
        if min(len(before[0]), len(after[0])) >= _FEWEST and _stood_still(
            before, (after[0] - length, after[1]), length
        ):
            found.append((float(time[hole + 1]), length))
    return found


def _means(at: np.ndarray, hz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return block means of times and speeds, as the noise of a speed signal is coloured."""
    size = max(1, len(at) // _BLOCKS)
    whole = len(at) // size * size
    return at[:whole].reshape(-1, size).mean(axis=1), hz[:whole].reshape(-1, size).mean(axis=1)


def _stood_still(before: tuple[np.ndarray, np.ndarray], after: tuple[np.ndarray, np.ndarray], length: float) -> bool:
    """Tell whether the speed is continuous across a gap although coast-down during the gap would have been detectable."""
    at, hz = (np.concatenate(sides) for sides in zip(before, after, strict=True))
    stepped = np.arange(len(at)) >= len(before[0])
    design = np.column_stack([np.ones(len(at)), at, at**2, stepped])
    fit, _, rank, _ = np.linalg.lstsq(design, hz, rcond=None)
    if rank < design.shape[1]:
        return False
    rest = hz - design @ fit
    sigma = float(np.sqrt(rest @ rest / (len(at) - 4) * np.linalg.inv(design.T @ design)[3, 3]))
    speed, slope, step = float(fit[0]), float(fit[1]), float(fit[3])
    if not speed > 0 or not slope < 0:
        return False
    slowing = speed * -np.expm1(slope * length / speed)
    return bool(slowing > _TOLD * sigma and abs(step) < max(_NONE * sigma, _SHARE * slowing))
