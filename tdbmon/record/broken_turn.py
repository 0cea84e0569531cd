"""Single revolutions that are too short or too long: samples lost or duplicated without a trace in the time axis."""

from __future__ import annotations

import numpy as np

from tdbmon.record.finding import Check
from tdbmon.record.keyphasor import Pulses
from tdbmon.record.timebase import before_holes, usual_interval

_LEAST = 0.02  # revolutions: rotor motion and thermal drift shift the mark by less
_SAMPLES = 4  # samples: the sampling of four edges alone may make a revolution differ from its neighbours by this much
_STEADY = 3.0  # times the spread of the neighbouring revolutions
_BESIDE = 2  # revolutions on either side


def broken_turn_checks(pulses: Pulses, time: np.ndarray) -> list[Check]:
    """Return a failed check if single revolutions are shorter or longer than the inertia of the rotor permits.

    Parameters
    ----------
    pulses : Pulses
        Pulses of the record's keyphasor.
    time : numpy.ndarray, shape (n,)
        Times of the keyphasor samples, s; revolutions that contain a gap in this time axis are not reported.
    """
    found = broken_turns(pulses, time)
    if not found:
        return []
    at, lost = found[0]
    what = "lost" if lost > 0 else "written twice"
    where = f"{len(found)} wrong revolutions: the first" if len(found) > 1 else "a revolution"
    detail = (
        f"{where} at {at:.5g} s is {abs(lost) * 1e3:.3g} ms {'shorter' if lost > 0 else 'longer'} than those before and after"
        f" it: samples of this duration, or of whole revolutions more, were {what}, and later times are wrong by it. Check for"
        " overruns of the logger's buffer, and export it again"
    )
    return [Check("lost samples", "time", False, detail)]


def broken_turns(pulses: Pulses, time: np.ndarray) -> list[tuple[float, float]]:
    """Return start time and shortening relative to its neighbours, s, of each such revolution (negative if longer)."""
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
