"""Detection of full whirl around the clearance, and of its direction.

A rotor that swings at the bottom moves back and forth, and one that bounces crosses the centre; neither circles it.
Backward whirl, in which the shaft rolls around the ring against its rotation, destroys touchdown bearings.  The criteria
require whole turns about the clearance centre:

- full whirl, in either direction: the angle about the centre advances by a turn or more while the shaft stays in the
  outer fifth of the clearance (radius >= 0.8 gap);
- backward whirl: it advances by a turn or more against the rotation at a radius of at least half the gap (a shaft that
  bounces its way round flies along chords).

An advance ends where the angle reverses by a quarter turn or the radius falls below the limit.  Its times are those of the
longest run of quarter turns without a slow one.  In the first and last turn, which may contain a swing, a slow one takes more
than twice the median time; in between more than four times, since quarter turns take unequal times on a noncircular path.

A clipped probe hides part of every turn: an arc of less than a third of a turn is bridged, if its angle agrees with the angular
velocity on both sides and it lasts less than a few turns of a whirl would.  A gap in the time axis ends an advance.  If more of
the orbit stays hidden than a few turns take, the absence of a detected whirl is inconclusive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from scipy.special import stdtrit
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.analysis.missing_stretches import too_long
from tdbmon.analysis.unbroken import pieces
from tdbmon.estimate import Estimate
from tdbmon.runs import runs_of

_FULL, _BACKWARD = 0.8, 0.5  # of the gap
_TURN, _BACK = 2 * np.pi, np.pi / 2
_QUARTERS = 4  # in a turn
_SLOW, _STOPS = 2.0, 4.0  # limits over the median time of a quarter turn: at the ends of an advance, and within it
_RATE_HZ = 2500.0  # sampling rate after decimation
_ROUNDING = 1e-6  # tolerance for rounding of a rate computed from times
_ARC = _TURN / 3  # longest missing arc with an unambiguous direction
_PACE = 3  # steps on either side from which the angular velocity is estimated
_HIDDEN_S = 0.02  # limit of missing time, in total or at once: some turns of a whirl
_RULE = "start of the first advance of a whole turn or more"


@dataclass(frozen=True)
class Advance:
    """A stretch over which the shaft centre circled the clearance centre by a turn or more.

    Attributes
    ----------
    start_s, end_s : float
    turns : float
        Positive in the direction of rotation.
    frequency : Estimate
        Whirl frequency, Hz.
    until_s : float
        Time at which the shaft reversed or fell below the radius limit, s: not before `end_s`.
    """

    start_s: float
    end_s: float
    turns: float
    frequency: Estimate
    until_s: float

    @property
    def duration_s(self) -> float:
        """Duration of the stretch, s."""
        return self.end_s - self.start_s


@dataclass(frozen=True)
class Whirl:
    """Whirl at one end.

    Attributes
    ----------
    backward_onset, full_onset : Estimate
        Start of the first advance that meets the criteria above, s.
    frequency : Estimate
        Of the longest advance of either kind, Hz.
    last_s : float
        End of the last advance, s; minus infinity if there is none.
    longest_backward, longest_full : Advance or None
        The longest advance of each kind; None if there is none.
    drawn : bool
        Whether the stated gap about the probes' zero was used, for lack of a clearance circle.
    hidden : str
        How much of the orbit is missing, if that may hide a whirl; empty if not.
    """

    backward_onset: Estimate
    full_onset: Estimate
    frequency: Estimate
    last_s: float
    longest_backward: Advance | None = None
    longest_full: Advance | None = None
    drawn: bool = False
    hidden: str = ""

    @property
    def backward(self) -> bool | None:
        """True if the shaft whirls backward; None if no such whirl was found but one may be hidden."""
        return self._told(self.longest_backward)

    @property
    def full(self) -> bool | None:
        """True if the shaft whirls around the whole clearance; None if no such whirl was found but one may be hidden."""
        return self._told(self.longest_full)

    @property
    def backward_longest_s(self) -> float | None:
        """Duration of the longest backward whirl, s; 0 if there is none, None if one may be hidden."""
        return self._longest_s(self.longest_backward)

    @property
    def full_longest_s(self) -> float | None:
        """Duration of the longest full whirl, s; 0 if there is none, None if one may be hidden."""
        return self._longest_s(self.longest_full)

    def _told(self, longest: Advance | None) -> bool | None:
        return None if longest is None and self.hidden else longest is not None

    def _longest_s(self, longest: Advance | None) -> float | None:
        if longest is None:
            return None if self.hidden else 0.0
        return longest.duration_s

    @property
    def worst(self) -> Advance | None:
        """The longest backward whirl, as it destroys bearings, or else the longest full whirl; None without either."""
        return self.longest_backward or self.longest_full


def whirl_about_drawing(planes: xr.Dataset, machine: Machine, end: str, start_s: float) -> Whirl:
    """Detect whirl at an end with the machine file's gap about the probes' zero, for lack of a clearance circle."""
    gap = machine.bearing(end).radial_gap.nominal
    return replace(find_whirl(planes, end, (0.0, 0.0), gap, machine.sense, start_s), drawn=True)


def find_whirl(
    planes: xr.Dataset, end: str, centre: Sequence[float] | np.ndarray, gap: float, sense: int, start_s: float = -np.inf
) -> Whirl:
    """Detect full and backward whirl at one end.

    Parameters
    ----------
    planes : Dataset
        ``displacement(end, axis, time)``, m.
    end : str
    centre : (2,) array
        Centre of the clearance, m.
    gap : float
        Radius of the clearance circle, m.
    sense : int
        +1 where the rotor turns from +x towards +y, -1 otherwise.
    start_s : float
        Start of the evaluation, which excludes the levitated stretch, s.

    Returns
    -------
    Whirl

    Raises
    ------
    InputError
        If `gap` is not positive.
    """
    time, radius, angle = _polar(planes, end, centre, gap, sense, start_s)
    hidden = _hidden(time, radius)
    full = _advances(time, angle, radius >= _FULL)
    backward = [a for a in _advances(time, angle, radius >= _BACKWARD) if a.turns < 0]
    longest, longest_backward, longest_full = (
        max(advances, key=lambda a: a.duration_s, default=None) for advances in (full + backward, backward, full)
    )
    return Whirl(
        backward_onset=_onset(backward, hidden or "the shaft does not circle against its rotation"),
        full_onset=_onset(full, hidden or "the shaft does not circle around the whole clearance"),
        frequency=longest.frequency if longest else Estimate.missing("Hz", hidden or "no whirl was found"),
        last_s=max((a.until_s for a in full + backward), default=-np.inf),
        longest_backward=longest_backward,
        longest_full=longest_full,
        hidden=hidden,
    )


def _polar(
    planes: xr.Dataset, end: str, centre: Sequence[float] | np.ndarray, gap: float, sense: int, start_s: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return decimated time, s, radius in gaps and angle about the centre, rad (positive with the rotation).

    Short missing arcs are bridged.
    """
    if not gap > 0:
        raise InputError(f"a gap of {gap * 1e6:g} um is not positive; give the radius of the clearance circle")
    time = planes.time.to_numpy()
    every = max(1, int(float(planes.attrs["sampling_hz"]) / _RATE_HZ + _ROUNDING))
    some = slice(int(np.searchsorted(time, start_s)), None, every)
    xy = planes.displacement.sel(end=end).transpose("axis", "time").to_numpy()[:, some]
    x, y = xy[0] - centre[0], sense * (xy[1] - centre[1])
    return time[some], *_bridged(time[some], np.hypot(x, y) / gap, np.arctan2(y, x))


def _bridged(time: np.ndarray, radius: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return radius and angle with missing samples interpolated over arcs whose length and direction are unambiguous."""
    for run in runs_of(np.isnan(angle)):
        before, after = run.start - 1, run.stop
        if before < _PACE or after + _PACE >= len(angle) or time[after] - time[before] > _HIDDEN_S:
            continue
        arc = np.angle(np.exp(1j * (angle[after] - angle[before])))
        sides = angle[before - _PACE : before + 1], angle[after : after + _PACE + 1]
        paces = [np.mean(np.angle(np.exp(1j * np.diff(side)))) for side in sides]
        steps = after - before
        # the angular velocity excludes a whole turn more or less; NaN beside the arc leaves none, and the test fails
        if abs(arc) < _ARC and abs(np.mean(paces) * steps - arc) < _BACK:
            share = np.arange(1, steps) / steps
            angle[run] = angle[before] + arc * share
            radius[run] = radius[before] + (radius[after] - radius[before]) * share
    return radius, angle


def _hidden(time: np.ndarray, radius: np.ndarray) -> str:
    """Return a statement of how much of the orbit is missing, if that may hide a whirl; "" if not."""
    if len(time) < 2:
        return ""
    steps, span = np.diff(time), time[-1] - time[0]
    holes = float(steps[too_long(steps)].sum())
    hidden = np.isnan(radius).mean() * (span - holes) + holes
    if hidden < _HIDDEN_S:
        return ""
    return f"{100 * hidden / span:.2g} % of the orbit is missing or clipped: a whirl may be hidden there"


def _advances(time: np.ndarray, angle: np.ndarray, outside: np.ndarray) -> list[Advance]:
    """Return the advances of a turn or more while `outside` holds."""
    found = []
    for piece in pieces(time):
        for run in runs_of(outside[piece]):
            when, course = time[piece][run], np.unwrap(angle[piece][run])
            if len(course) < 4 or np.ptp(course) < _TURN:
                continue
            for a, b in _legs(course):
                if abs(course[b] - course[a]) >= _TURN:
                    found.append(_advance(when[a : b + 1], course[a : b + 1]))
    return found


def _legs(course: np.ndarray) -> list[tuple[int, int]]:
    """Return the stretches (first and last index) between reversals of a quarter turn or more."""
    turning = np.flatnonzero(np.diff(np.sign(np.diff(course))) != 0) + 1
    legs, pivot, extreme, way = [], 0, 0, 0
    low = high = 0
    for i in (0, *turning.tolist(), len(course) - 1):
        if way == 0:
            low, high = (i if course[i] < course[low] else low), (i if course[i] > course[high] else high)
            if course[high] - course[low] >= _BACK:
                pivot, extreme = (low, high) if low < high else (high, low)
                way = 1 if low < high else -1
        elif way * (course[i] - course[extreme]) > 0:
            extreme = i
        elif way * (course[extreme] - course[i]) >= _BACK:
            legs.append((pivot, extreme))
            pivot, extreme, way = extreme, i, -way
    if way:
        legs.append((pivot, extreme))
    return legs


def _advance(time: np.ndarray, course: np.ndarray) -> Advance:
    """Return the advance timed by its longest run of quarter turns without a slow one, which would be a swing or a stop."""
    way = np.sign(course[-1] - course[0])
    quarters = way * (course - course[0]) / _BACK
    to_come = np.minimum.accumulate(quarters[::-1])[::-1]  # least progress from each sample on
    passed = time[
        np.searchsorted(to_come, np.arange(int(quarters[-1] + 1e-9) + 1), side="right").clip(max=len(time) - 1)
    ]
    taken = np.diff(passed)
    most = np.full(len(taken), _STOPS)
    most[:_QUARTERS] = most[-_QUARTERS:] = _SLOW
    slow = np.flatnonzero(taken > most * np.median(taken))
    begins, ends = np.append(0, slow + 1), np.append(slow, len(taken))
    longest = int(np.argmax(ends - begins))
    first, last = int(begins[longest]), int(ends[longest])
    if last - first < _QUARTERS:
        first, last = 0, len(taken)
    start, end, turns = float(passed[first]), float(passed[last]), (last - first) / _QUARTERS
    rates = 1 / np.diff(passed[first : last + 1 : _QUARTERS])
    mean = turns / (end - start)
    if len(rates) < 3:
        frequency = Estimate(mean, unit="Hz", method="turns divided by their duration", why="fewer than three turns")
    else:
        half = float(stdtrit(len(rates) - 1, 0.975) * np.std(rates, ddof=1) / np.sqrt(len(rates)))
        rule = "turns divided by their duration; interval: scatter of the turns"
        frequency = Estimate(mean, mean - half, mean + half, "Hz", rule)
    return Advance(start, end, float(way * turns), frequency, float(time[-1]))


def _onset(advances: list[Advance], why: str) -> Estimate:
    if not advances:
        return Estimate.missing("s", why)
    first = min(a.start_s for a in advances)
    return Estimate(first, unit="s", method=_RULE, why="no interval: defined to a quarter turn")
