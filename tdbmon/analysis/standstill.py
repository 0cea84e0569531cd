"""Time of standstill of the rotor, from the fitted drag law and from the speed signal itself."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

import numpy as np

from tdbmon.analysis.autoregression import noise_of
from tdbmon.analysis.drag_law import Coast, LawFit, slowing_time
from tdbmon.estimate import Estimate

_TAIL = 0.05  # last share of the record, by which rest is judged
_GROUPS = 200  # parts in which the end of rotation is sought
_REST_SHARE = 0.01  # of the speed at release: a steady level below is the zero offset of the signal
_TURNING, _LOST = 4.0, 1.0  # standard deviations: certain rotation above, speed lost in the noise below
_CREEP = 3.0  # level over its decrease within half the tail, for an exponential creep of time constant 1.5 tails
# the signal must stay at rest for this multiple of the time that the speed takes from certain rotation into the noise,
# since an exponential creep is lost in the noise near the end of every record, however long
_QUIET = 2.0
# ratio of speeds of two successive falls: a rotor that stops takes less time for the second than for the first
_FASTER = 4.0
_STOPS = 0.5  # largest ratio of these times for a stop; exponential creep has 1, dry friction 1/4
_DRAWS = 2000
FARTHEST = 3.0  # longest extrapolation, in lengths of the record after the release


@dataclass(frozen=True)
class Rest:
    """Evidence of standstill at the end of a record.

    Attributes
    ----------
    found : bool
        True if the record reaches standstill.
    turning_until, lost_from : float
        Last time at which the rotor certainly turns, and first at which its speed is lost in the noise, s.
    level, level_sigma : float
        Zero offset of the signal (its reading at rest) and its standard deviation, Hz.
    creep : float
        Standard deviation of the zero if the rotor may still creep, including an undetected decrease of the level, Hz.
    resolution : float
        Smallest speed that is distinguishable from rest, Hz.
    turned_at : float
        Start of the part that ends at `turning_until`, or time of the last pulse, s: the rotor may stop within that part.
    creeps : bool
        True if the speed fades like that of a rotor that creeps on below the resolution.
    """

    found: bool
    turning_until: float
    lost_from: float
    _: KW_ONLY
    level: float = 0.0
    level_sigma: float = 0.0
    creep: float = 0.0
    resolution: float = 0.0
    turned_at: float = 0.0
    creeps: bool = False


def find_rest(coast: Coast, turns: Coast | None) -> Rest:
    """Find the end of rotation in a speed signal.

    Parameters
    ----------
    coast : Coast
        Block means from the release to the record's end.
    turns : Coast or None
        Mean speeds between keyphasor pulses, if there are any: a rotor that still gives pulses is not at rest.
    """
    last = float(coast.end[-1])
    none = Rest(False, last, last)
    count = max(int(_TAIL * len(coast)), 8)
    if len(coast) < 8 * count:
        return none
    tail, head = coast.mean[-count:], float(np.median(coast.mean[:count]))
    spread = noise_of(tail, 1).slow
    level, sigma = float(tail.mean()), spread / np.sqrt(count)
    fall = float(tail[: count // 2].mean() - tail[-(count // 2) :].mean())
    if abs(level) > _REST_SHARE * head or fall > 4 * 2 * sigma:
        return none
    if turns is not None and len(turns) and turns.end[-1] > coast.begin[-count]:
        return none
    size = max(len(coast) // _GROUPS, 1)
    parts = coast.grouped(size)
    mean = parts.mean - level
    one = float(np.hypot(spread / np.sqrt(size), sigma))
    final = _last_above(mean, _TURNING * one)
    if final is None:
        return none
    fast, slow = (_last_above(mean, times * _TURNING * one) for times in (_FASTER**2, _FASTER))
    # a speed that is low from the start does not show whether it stops or creeps
    creeps = fast is not None and slow is not None and final - slow > max(_STOPS * (slow - fast), 1)
    lost = np.flatnonzero(mean[final:] < _LOST * one)
    lost_from = float(parts.end[final + lost[0]]) if lost.size else last
    until = float(parts.end[final])
    fading, turned = lost_from - until, float(parts.begin[final])
    if turns is not None and len(turns):
        pulse = float(turns.end[-1])
        until, lost_from, turned = max(until, pulse), max(lost_from, pulse), max(turned, pulse)
    if last - lost_from < _QUIET * fading:
        return none
    creep = float(np.hypot(sigma, _CREEP * max(fall, 0.0)))
    resolution = _TURNING * one
    return Rest(
        True,
        until,
        lost_from,
        level=level,
        level_sigma=sigma,
        creep=creep,
        resolution=resolution,
        turned_at=turned,
        creeps=creeps,
    )


def _last_above(mean: np.ndarray, level: float) -> int | None:
    """Return the last part whose mean and that of the part before exceed a level, as one alone may by chance; None if none."""
    above = mean > level
    both = np.flatnonzero(above[1:] & above[:-1])
    return int(both[-1]) + 1 if both.size else None


def stop_seen(rest: Rest, why: str) -> Estimate:
    """Return the time of standstill seen in the signal, s, without a law; missing, with `why` as further reason, if not seen."""
    if not rest.found:
        return Estimate.missing("s", f"the record ends before standstill, and {why}")
    if rest.creeps:
        fades = f"then the speed is below the resolution of its signal, {rest.resolution * 1e3:.1f} mHz"
        return Estimate.missing("s", f"not before {rest.turned_at:.4g} s; {fades}, and the rotor may still creep")
    method = f"speed signal below its resolution ({rest.resolution * 1e3:.1f} mHz)"
    return Estimate(0.5 * (rest.turned_at + rest.lost_from), rest.turned_at, rest.lost_from, "s", method)


def stop_time(fit: LawFit, rest: Rest, reached: bool, last: float, release: float) -> Estimate:
    """Return the time of standstill, s, from the law and the signal.

    Parameters
    ----------
    fit : LawFit
        The chosen law.
    rest : Rest
        From `find_rest`.
    reached : bool
        True if the law fits the record up to standstill, or to its end.
    last, release : float
        End of the record and release, s.
    """
    stop = fit.law.standstill
    if rest.found and not (reached and np.isfinite(stop)):
        return stop_seen(rest, "")
    if not np.isfinite(stop):
        return Estimate.missing("s", "the record ends before standstill, and the law without constant drag never stops")
    if not reached:
        return Estimate.missing("s", "the fitted law does not hold down to the lowest measured speed")
    times = np.sort(fit.law.start + slowing_time(fit.draw(_DRAWS), 0.0))
    low, high = times[round(0.025 * _DRAWS)], times[round(0.975 * _DRAWS)]
    if rest.found:
        return Estimate(stop, float(low), float(min(high, last)), "s", "zero of the fitted law, which holds down to standstill")
    if high > last + FARTHEST * (last - release):
        return Estimate.missing("s", f"the record ends at {last:.3g} s, too early to say when the rotor stops")
    scatter = f"{low:.4g} to {high:.4g} s if it does"
    why = f"no interval: it is not known whether the law holds down to standstill ({scatter})"
    return Estimate(
        stop, unit="s", method="extrapolated: zero of the fitted law, below the lowest measured speed", why=why
    )
