"""An end that its magnetic bearing goes on holding while the other one falls: no drop of this end, and no fault of its probes.

It stays well inside its gap.  So does, as it is read, a shaft that falls on a scale several times too small; but that settles
straight down, by most of its greatest excursion, and a whirl on such a scale goes on moving as widely.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.machine import Machine, TouchdownBearing

from tdbmon.record.finding import Check, um

Path = tuple[NDArray[np.float64], NDArray[np.complex128]]

_TOUCHED = 0.75  # of the smallest gap: who never gets so far from where he levitated touched nothing
HEAD_S = 5e-3  # at the start, that shows where the shaft levitates
_WAITS = 5.0  # times the fall through the gap: the other end has fallen for so long at least
_FREE = 0.9  # of that time, before which nothing is touched
_LATE = 0.25  # of what follows the other end's fall: there the shaft has settled, if it does
# of the greatest excursion, by which a shaft that fell lies away at rest at least; three quarters are usual
_SETTLES = 0.5
_MOVES = 0.5  # of it, rms: a whirl
DOWN_DEG = 60.0  # within which a fall goes down, however the bearing bounced it aside
_LEAST_TURNS, _TURNS = 5, 20  # of the shaft, in which it is asked for once per revolution
_BOUNCING_S = 0.1  # after the fall of the other end, whose blows are felt at this one
_SLOWER = 0.15  # of the speed, by which it falls until then at most
_HUM = 0.05  # of the speed: mains so near look like once per revolution


def middle(z: NDArray[np.complex128]) -> complex:
    """Return the median place of a path, axis by axis: numpy's own median of complex numbers is a point on an orbit."""
    return complex(np.median(z.real), np.median(z.imag))


def aside(moved: complex) -> float:
    """Return by how much a motion goes to the side of straight down, deg."""
    return abs(float(np.degrees(np.angle(moved / -1j))))


def never_touches(start: complex, reach: float, bearing: TouchdownBearing, share: float = _TOUCHED) -> bool:
    """Return whether a shaft that levitates at `start` (from the middle, m) and moves by `reach` at most touched nothing.

    That is less than a `share` of the smallest gap.
    """
    return reach < share * (bearing.radial_gap.low - abs(start))


def ends_in_fall(planes: xr.Dataset, end: str, machine: Machine, release_s: float) -> str:
    """Say that a record ends while an end still falls; "" where it may have touched, or had the time to."""
    time, z = paths_of(planes)[end]
    before, after = np.isfinite(z) & (time < release_s), np.isfinite(z) & (time >= release_s)
    bearing, left = machine.bearing(end), float(time[-1]) - release_s
    if not before.any() or not after.any() or machine.gravity <= 0:
        return ""
    start = middle(z[before])
    falls_for = float(np.sqrt(2 * bearing.radial_gap.nominal / machine.gravity))
    if left > _WAITS * falls_for:
        return ""
    if left > _FREE * falls_for and not never_touches(start, float(np.abs(z[after] - start).max()), bearing):
        return ""
    return (
        f"the record ends {left * 1e3:.2g} ms after the release, while the shaft still falls and has touched nothing: record for"
        " a second or more after the release"
    )


def held_ends(paths: Mapping[str, Path], machine: Machine) -> dict[str, float]:
    """Return the greatest excursion, m, of each end that stays levitated while another one falls.

    Parameters
    ----------
    paths : mapping
        Time, s, and x + i y, m, of the ends that are seen, from levitation on; NaN where a sample is missing.
    machine : Machine
    """
    if machine.gravity <= 0:
        return {}
    seen = {end: (t[good], z[good]) for end, (t, z) in paths.items() if (good := np.isfinite(z)).any()}
    starts = {end: middle(z[t < t[0] + HEAD_S]) for end, (t, z) in seen.items()}
    away = {end: np.abs(z - starts[end]) for end, (_, z) in seen.items()}
    inside = [end for end in seen if never_touches(starts[end], float(away[end].max()), machine.bearing(end))]
    fell = falls_at({end: seen[end] for end in seen if end not in inside}, machine)
    if fell is None:
        return {}
    held = {}
    for end in inside:
        time, z = seen[end]
        fall = float(np.sqrt(2 * machine.bearing(end).radial_gap.nominal / machine.gravity))
        late = time > max(fell, time[-1] - _LATE * (time[-1] - fell))
        if time[-1] > fell + _WAITS * fall and not _like_a_fall(z[late] - starts[end], float(away[end].max())):
            held[end] = float(away[end].max())
    return held


def falls_at(paths: Mapping[str, Path], machine: Machine) -> float | None:
    """Return when the first of some ends has gone farther than a levitated shaft does, s; None where none has."""
    when = []
    for end, (time, z) in paths.items():
        good = np.isfinite(z)
        if not good.any():
            continue
        time, z = time[good], z[good]
        z = z - middle(z[time < time[0] + HEAD_S])
        far = np.abs(z) > _TOUCHED * machine.bearing(end).radial_gap.low
        when += [float(time[np.argmax(far)])] if far.any() else []
    return min(when, default=None)


def _like_a_fall(late: NDArray[np.complex128], reach: float) -> bool:
    """Return whether a shaft lies or moves late in a record, from where it levitated, as a drop on a small scale does."""
    rest = complex(np.mean(late))
    return bool((aside(rest) < DOWN_DEG and abs(rest) > _SETTLES * reach) or np.std(late) > _MOVES * reach)


def turns_throughout(
    time: NDArray[np.float64], signal: NDArray[np.float64], hz: float, fell: float, mains: float
) -> bool:
    """Return whether a probe sees the shaft turn before and after the other end falls: then it is neither dead nor cut off.

    Parameters
    ----------
    time, signal : (n,) arrays
        s and m, without missing samples.
    hz : float
        Speed before the fall.
    fell : float
        When the other end falls, s.
    mains : float
        Hz; hum near the speed tells nothing.
    """
    if hz <= 0 or abs(hz - mains) < _HUM * hz:
        return False
    long = _TURNS / hz
    stretches = (
        time < min(fell - 2 * HEAD_S, time[0] + long),
        (time > fell + _BOUNCING_S) & (time < fell + _BOUNCING_S + long),
    )
    return all(_turns(time[part], signal[part], hz) for part in stretches)


def _turns(time: NDArray[np.float64], signal: NDArray[np.float64], hz: float) -> bool:
    """Return whether a line at the speed, or a little below it, stands out of all else in a stretch."""
    if len(time) < 8 or (time[-1] - time[0]) * hz < _LEAST_TURNS:
        return False
    t, y = time - time[0], signal - np.mean(signal)
    tried = np.arange(hz * (1 - _SLOWER), hz * 1.02, 0.25 / t[-1])
    size = max(2 * abs(np.mean(y * np.exp(-2j * np.pi * f * t))) for f in tried)
    return bool(size**2 > np.mean(y**2))  # half of the variance or more


def paths_of(planes: xr.Dataset) -> dict[str, Path]:
    """Return the paths of the ends at the bearing planes (`tdbmon.analysis.axes.to_planes`)."""
    time = planes.time.to_numpy()
    x, y = planes.displacement.transpose("axis", "end", "time").to_numpy()
    return {str(end): (time, x[i] + 1j * y[i]) for i, end in enumerate(planes.end.values)}


def said_held(end: str, reach: float, machine: Machine) -> str:
    """Say that an end stayed levitated."""
    gap = machine.bearing(end).radial_gap.nominal
    return (
        f"stayed levitated (did not fall): it moves {um(reach)} at most from where it levitated, in a gap of {um(gap)}"
    )


def held_check(end: str, reach: float, machine: Machine) -> Check:
    """Return the row that says so among the checks of a record."""
    others = " and ".join(each for each in machine.ends if each != end)
    said = f"{said_held(end, reach, machine)}, while {others} fell: the magnetic bearing held this end, and only {others} dropped"
    return Check("held", end, False, said)
