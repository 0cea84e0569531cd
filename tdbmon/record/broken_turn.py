"""A turn of the shaft that alone is too short or too long: samples that were lost, or written twice, without a trace."""

from __future__ import annotations

import numpy as np

from tdbmon.record.finding import Check
from tdbmon.record.keyphasor import Pulses
from tdbmon.record.timebase import before_holes, usual_interval

_LEAST = 0.02  # turns: what bounces and runs hot shifts a mark by less
_SAMPLES = 4  # by which the rounding of four edges may make a turn differ from its neighbours
_STEADY = 3.0  # times what the turns beside differ among each other
_BESIDE = 2  # turns on either side


def broken_turn_checks(pulses: Pulses, time: np.ndarray) -> list[Check]:
    """Return a failed check of the turns that no shaft makes: it has inertia, and does not hurry through one alone.

    Parameters
    ----------
    pulses : Pulses
        Of the record's keyphasor.
    time : numpy.ndarray, shape (n,)
        Of its samples, s; turns in which that has a hole are no finding.
    """
    found = broken_turns(pulses, time)
    if not found:
        return []
    at, lost = found[0]
    what = "lost" if lost > 0 else "written twice"
    where = f"{len(found)} turns, the first" if len(found) > 1 else "a turn of the shaft"
    detail = (
        f"{where} at {at:.5g} s is {abs(lost) * 1e3:.3g} ms {'shorter' if lost > 0 else 'longer'} than those before and after"
        f" it: so much was {what} there, or whole turns more, and the times after it are wrong by that. Look for overruns of"
        " the logger's buffer, and export it again"
    )
    return [Check("lost samples", "time", False, detail)]


def broken_turns(pulses: Pulses, time: np.ndarray) -> list[tuple[float, float]]:
    """Return when such turns begin and how much shorter they are than those beside them, s."""
    intervals, steps = np.diff(pulses.times), np.diff(pulses.turns)
    if intervals.size < 2 * _BESIDE + 1 or time.size < 2:
        return []
    turn = intervals / steps
    sides = np.lib.stride_tricks.sliding_window_view(turn, 2 * _BESIDE + 1)
    sides = np.delete(sides, _BESIDE, axis=1)
    inner = slice(_BESIDE, turn.size - _BESIDE)
    usual = 0.5 * (sides[:, _BESIDE - 1] + sides[:, _BESIDE])
    lost = steps[inner] * usual - intervals[inner]
    least = np.maximum(_LEAST * usual, _SAMPLES * usual_interval(time))
    broken = np.abs(lost) > np.maximum(least, _STEADY * np.ptp(sides, axis=1))
    holes = before_holes(time)
    begin, end = pulses.times[:-1][inner], pulses.times[1:][inner]
    whole = np.searchsorted(holes, begin) == np.searchsorted(holes, end)
    return [(float(begin[k]), float(lost[k])) for k in np.flatnonzero(broken & whole)]
