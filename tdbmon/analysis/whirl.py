"""Whirl of the shaft around its clearance, from the angle of the shaft centre about the clearance centre.

A rotor that swings at the bottom turns back; one that whirls goes round.  Looked at are the stretches in which the shaft
keeps to the ring (radius at least 0.8 of the clearance circle, interrupted for 3 ms at the most).  A whirl is *full* where
the angle advances by a whole turn within such a stretch, and *backward* where it does so against the rotation: friction
then drives the shaft round, up to speeds that destroy the bearing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from tdbmon.estimate import Estimate

_ON_RING = 0.8  # of the clearance circle's radius
_INTERRUPTED_S = 3e-3
_RATE_HZ = 4000.0
_TURN = 2 * np.pi
_DEPARTS = 0.1  # rad: a whirl begins where it leaves the place at which the shaft lay by this much
_SAMPLE = "by rule, to the sample"


@dataclass(frozen=True)
class Whirl:
    """Whirl of one end.

    Attributes
    ----------
    backward, full : bool
        Whether a whole turn was made against the rotation; whether one was made in either sense.
    backward_onset, full_onset : Estimate
        When the first such turn begins, s from the record's first sample.
    backward_duration, full_duration : Estimate
        Time from that onset to the end of the longest whirl of the kind, s.
    frequency : Estimate
        Mean frequency of the longest whirl, Hz; negative against the rotation.
    """

    backward: bool
    full: bool
    backward_onset: Estimate
    full_onset: Estimate
    backward_duration: Estimate
    full_duration: Estimate
    frequency: Estimate


@dataclass(frozen=True)
class _Run:
    start: float
    end: float
    turns: float  # signed, positive with the rotation

    @property
    def seconds(self) -> float:
        return self.end - self.start


def find_whirl(
    planes: xr.Dataset, end: str, centre: tuple[float, float], radius: float, sense: int, start_s: float
) -> Whirl:
    """Look for full and backward whirl of one end.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    end : str
    centre, radius : float
        The clearance circle, m.
    sense : int
        +1 where the rotor turns counter-clockwise, -1 where clockwise.
    start_s : float
        From when on to look, s: the release.
    """
    time, angle, on_ring = _course(planes, end, centre, radius, sense, start_s)
    runs = [run for first, last in _stretches(time, on_ring) for run in _turns(time[first:last], angle[first:last])]
    backward = [run for run in runs if run.turns < 0]
    none = "no whole turn around the clearance was made"
    if not runs:
        s, hz = Estimate.missing("s", none), Estimate.missing("Hz", none)
        return Whirl(False, False, s, s, s, s, hz)
    longest = max(runs, key=lambda run: run.seconds)
    against = "no whole turn against the rotation was made"
    return Whirl(
        bool(backward),
        True,
        _stated(min(run.start for run in backward)) if backward else Estimate.missing("s", against),
        _stated(min(run.start for run in runs)),
        _stated(max(run.seconds for run in backward)) if backward else Estimate.missing("s", against),
        _stated(longest.seconds),
        Estimate(
            longest.turns / longest.seconds, unit="Hz", method="turns over time of the longest whirl", why=_SAMPLE
        ),
    )


def _stated(seconds: float) -> Estimate:
    return Estimate(seconds, unit="s", method="angle about the clearance centre", why=_SAMPLE)


def _course(
    planes: xr.Dataset, end: str, centre: tuple[float, float], radius: float, sense: int, start_s: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, unwrapped angle in the sense of rotation, and whether the shaft keeps to the ring."""
    rate = planes.attrs["sampling_hz"]
    count = max(1, int(rate / _RATE_HZ))
    first = int(np.searchsorted(planes.time.to_numpy(), start_s))
    xy = planes.displacement.sel(end=end).to_numpy()[:, first:]
    whole = xy.shape[1] // count * count
    x, y = xy[:, :whole].reshape(2, -1, count).mean(axis=2) - np.array(centre)[:, None]
    time = planes.time.to_numpy()[first : first + whole].reshape(-1, count).mean(axis=1)
    seen = np.isfinite(x) & np.isfinite(y)
    time, x, y = time[seen], x[seen], y[seen]
    return time, sense * np.unwrap(np.arctan2(y, x)), np.hypot(x, y) >= _ON_RING * radius


def _stretches(time: np.ndarray, on_ring: np.ndarray) -> list[tuple[int, int]]:
    """Index ranges in which the shaft keeps to the ring, short interruptions included."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on_ring.astype(np.int8), [0]])))
    out: list[list[int]] = []
    for first, last in edges.reshape(-1, 2):
        if out and time[first] - time[out[-1][1] - 1] <= _INTERRUPTED_S:
            out[-1][1] = int(last)
        else:
            out.append([int(first), int(last)])
    return [(first, last) for first, last in out if last - first > 3]


def _turns(time: np.ndarray, angle: np.ndarray) -> list[_Run]:
    """Longest advance of at least one turn in each sense within a stretch."""
    out = []
    for sign in (1, -1):
        course = sign * angle
        lowest = np.minimum.accumulate(course)
        advance = course - lowest
        top = int(np.argmax(advance))
        if advance[top] < _TURN:
            continue
        begin = int(np.flatnonzero(course[: top + 1] < lowest[top] + _DEPARTS)[-1])
        out.append(_Run(float(time[begin]), float(time[top]), sign * float(advance[top]) / _TURN))
    return out
