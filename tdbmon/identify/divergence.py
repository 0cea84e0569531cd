"""Divergence of neighbouring paths of a machine's drops: the exponential rate at which a model's error grows.

Paths with impacts diverge exponentially, in a small fast spindle three times as fast as in a heavy rotor with wide gaps.  The
rate is a property of the machine and its drops; it is computed by simulation at values drawn from the prior.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.drop import USUAL_DIVERGENCE
from tdbmon.identify.prediction import model_error
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_WINDOW_S = 0.01  # s, length of the last window, in which the distance of the diverged paths is measured
_FALLING_S = 0.005  # s after the release, up to which the shaft falls freely in a usual gap
_POINTS = 8  # simulated per drop: rates differ widely from path to path
_SPREAD = 0.5  # of the prior standard deviation, for the points drawn
_DECIDING = 0.02  # of the gap: an error of the path that decides where the shaft touches next
_APART = 1e-9  # m/s, difference of neighbours' velocities at the release


def with_divergence(problem: Problem) -> Problem:
    """Return a problem with the divergence rate set in its drops, which determines the growth of the model's error."""
    rate = divergence(problem)
    return replace(problem, drops=tuple(replace(drop, divergence=rate) for drop in problem.drops))


def followable(problem: Problem, horizons: Sequence[float]) -> list[float]:
    """Return the increasing horizons, s after the release, up to which the model's error does not yet decide the next contact.

    The first is always among them, as are those up to the bounce of both ends.
    """
    least = _least_gap(problem)
    return [
        horizon
        for horizon in horizons
        if horizon <= max(problem.stages.bounced, horizons[0])
        or all(model_error(drop, np.array(horizon)) < _DECIDING * least for drop in problem.drops)
    ]


def parting_remarks(problem: Problem, asked: Sequence[float], followed: Sequence[float]) -> tuple[str, ...]:
    """Return a remark where the drops are followed less far than requested."""
    if followed[-1] == asked[-1]:
        return ()
    rate = max(drop.divergence for drop in problem.drops)
    part = f"neighbouring paths of this machine diverge by a factor of e every {1e3 / rate:.0f} ms"
    if rate > USUAL_DIVERGENCE:
        part += f" (usually {1e3 / USUAL_DIVERGENCE:.0f} ms)"
    return (
        f"{part}; by {asked[len(followed)] * 1e3:g} ms the error of a path has grown to"
        f" {100 * _DECIDING:g} % of the smallest gap ({_least_gap(problem) * 1e6:.0f} um) and decides what touches next: the"
        f" drops are fitted to {followed[-1] * 1e3:g} ms after the release instead of {asked[-1] * 1e3:g} ms",
    )


def _least_gap(problem: Problem) -> float:
    """Return the smallest radial gap of the touchdown bearings by the machine file, m."""
    return min(end.radial_gap.nominal for end in problem.model.machine.touchdown_bearings)


def divergence(problem: Problem) -> float:
    """Return the divergence rate of neighbouring paths, 1/s, at least the usual one.

    It is the median over drawn points and all drops, from the first contact to the horizon up to which all models are followed.
    Neighbours differ in velocity at the release, so their distance also grows linearly in free fall; this growth is divided out.

    Parameters
    ----------
    problem : Problem
    """
    rng = np.random.default_rng(0)
    starts = [rng.standard_normal(len(problem.start)) for _ in range(_POINTS)]
    points = [np.clip(_SPREAD * start, problem.low, problem.high) for start in starts]
    by_drop = problem.each(lambda drop: [_rate(problem, point, drop) for point in points])
    rates = [rate for of_drop in by_drop for rate in of_drop if math.isfinite(rate)]
    return max(USUAL_DIVERGENCE, float(np.median(rates))) if rates else USUAL_DIVERGENCE


def _rate(problem: Problem, point: Array, drop: int) -> float:
    """Return the divergence rate about one path, 1/s; NaN where it cannot be simulated."""
    horizon = min(problem.stages.followed, problem.drops[drop].seconds)
    where = problem.columns(drop)[len(problem.shared) :]
    speeds = [c for c, p in zip(where, problem.own[drop], strict=True) if p.name.startswith("velocity")]
    apart: Array = np.zeros(1)
    try:
        path = problem.simulated(point, drop, horizon)
        for column in speeds:  # divergence is fast in one direction and slow in another
            near = point.copy()
            near[column] += _APART / problem.parameters[column].scale
            apart = apart + np.mean((problem.simulated(near, drop, horizon).readings - path.readings) ** 2, axis=0)
    except InputError:
        return math.nan
    time = path.since
    falling = problem.stages.at(_FALLING_S)
    fall = (time > falling / 2) & (time <= falling)
    late = time > horizon - _WINDOW_S
    grown = math.sqrt(np.mean(apart[late] / time[late] ** 2) / np.mean(apart[fall] / time[fall] ** 2))
    return math.log(grown) / (horizon - _WINDOW_S / 2 - problem.stages.flight) if grown > 0 else math.nan
