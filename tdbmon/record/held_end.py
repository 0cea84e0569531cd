"""Detection of a shaft end that stays levitated while the other one drops: neither a drop of this end nor a probe fault.

Such an end stays well within its gap.  So does, apparently, a falling shaft whose displacement is scaled several times too
small; but that one settles straight below by most of its greatest excursion, or whirls on with undiminished amplitude.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.machine import Machine, TouchdownBearing

from tdbmon.record.finding import Check, um

Path = tuple[NDArray[np.float64], NDArray[np.complex128]]

_TOUCHED = 0.75  # of the smallest gap: a shaft that never moves this far from its levitated position made no contact
HEAD_S = 5e-3  # start of the record that gives the levitated position
_WAITS = 5.0  # times the free-fall time through the gap: required duration after the other end's fall
_FREE = 0.9  # of the free-fall time: no contact is possible before
_LATE = 0.25  # of the record after the other end's fall, at its end: a shaft that settles at all has settled by then
# of the greatest excursion: least distance of a fallen shaft's rest position from levitation; 0.75 is typical
_SETTLES = 0.5
_MOVES = 0.5  # of the greatest excursion, rms: more is a whirl
DOWN_DEG = 60.0  # from straight down: a fallen shaft rests within, however it bounced sideways
_LEAST_TURNS, _TURNS = 5, 20  # revolutions: least and usual length of the stretches searched for 1X
_BOUNCING_S = 0.1  # after the other end's fall, while its impacts are felt at this end
_SLOWER = 0.15  # of the speed: largest drop until then
_HUM = 0.05  # of the speed: mains hum this close is indistinguishable from 1X


def middle(z: NDArray[np.complex128]) -> complex:
    """Return the median position of a path, axis by axis (numpy's complex median sorts by x and returns an orbit point)."""
    return complex(np.median(z.real), np.median(z.imag))


def aside(moved: complex) -> float:
    """Return the absolute angle of a displacement from straight down, deg."""
    return abs(float(np.degrees(np.angle(moved / -1j))))


def never_touches(start: complex, reach: float, bearing: TouchdownBearing, share: float = _TOUCHED) -> bool:
    """Return whether a shaft levitated at `start` (from the centre, m) with the largest excursion `reach`, m, made no contact.

    That is, `reach` is less than the fraction `share` of the smallest radial gap left at `start`.
    """
    return reach < share * (bearing.radial_gap.low - abs(start))


def ends_in_fall(planes: xr.Dataset, end: str, machine: Machine, release_s: float) -> str:
    """Return a message if the record ends while this end is still falling; "" if contact was possible before."""
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
        f"the record ends {left * 1e3:.2g} ms after the release, while the shaft is still falling without contact: record for"
        " a second or more after the release"
    )


def held_ends(paths: Mapping[str, Path], machine: Machine) -> dict[str, float]:
    """Return the greatest excursion, m, of each end that stays levitated while another one falls.

    Parameters
    ----------
    paths : mapping
        Time, s, and x + i y, m, of each measured end, beginning in levitation; NaN where a sample is missing.
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
    """Return the time, s, at which the first of some ends leaves the range of a levitated shaft; None if none does."""
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
    """Return whether the late motion relative to the levitated position resembles a drop measured on too small a scale."""
    rest = complex(np.mean(late))
    return bool((aside(rest) < DOWN_DEG and abs(rest) > _SETTLES * reach) or np.std(late) > _MOVES * reach)


def turns_throughout(
    time: NDArray[np.float64], signal: NDArray[np.float64], hz: float, fell: float, mains: float
) -> bool:
    """Return whether a probe shows 1X before and after the other end's fall, so that it is neither dead nor cut off.

    Parameters
    ----------
    time, signal : (n,) arrays
        Time, s, and displacement, m, without missing samples.
    hz : float
        Speed before the fall, Hz.
    fell : float
        Time of the other end's fall, s.
    mains : float
        Mains frequency, Hz; if it is close to the speed, the result is False, as 1X cannot be told from hum.
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
    """Return whether a line at or slightly below the speed dominates the variance of a stretch."""
    if len(time) < 8 or (time[-1] - time[0]) * hz < _LEAST_TURNS:
        return False
    t, y = time - time[0], signal - np.mean(signal)
    tried = np.arange(hz * (1 - _SLOWER), hz * 1.02, 0.25 / t[-1])
    size = max(2 * abs(np.mean(y * np.exp(-2j * np.pi * f * t))) for f in tried)
    return bool(size**2 > np.mean(y**2))  # half of the variance or more


def paths_of(planes: xr.Dataset) -> dict[str, Path]:
    """Return the path of each end at its bearing plane (`tdbmon.analysis.axes.to_planes`)."""
    time = planes.time.to_numpy()
    x, y = planes.displacement.transpose("axis", "end", "time").to_numpy()
    return {str(end): (time, x[i] + 1j * y[i]) for i, end in enumerate(planes.end.values)}


def said_held(end: str, reach: float, machine: Machine) -> str:
    """Return the statement that an end stayed levitated, with its largest excursion."""
    gap = machine.bearing(end).radial_gap.nominal
    return (
        f"stayed levitated (did not fall): it moves at most {um(reach)} from its levitated position, in a gap of {um(gap)}"
    )


def held_check(end: str, reach: float, machine: Machine) -> Check:
    """Return the failed check for an end that stayed levitated."""
    others = " and ".join(each for each in machine.ends if each != end)
    said = f"{said_held(end, reach, machine)}, while {others} fell: the magnetic bearing held this end, and only {others} dropped"
    return Check("held", end, False, said)
