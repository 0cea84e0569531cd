"""How fast neighbouring paths of a machine's drops part: the rate at which a model's error grows.

Paths with impacts part exponentially, in a small fast spindle three times as fast as in a heavy rotor with wide gaps.  The
rate is a property of the machine and its drops, and told by simulations at values drawn from what is known beforehand.
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

_WINDOW_S = 0.01  # s, as far as all are followed: by its end paths have parted
_FALLING_S = 0.005  # s; so far a shaft falls freely in a usual gap
_POINTS = 8  # simulated a drop: rates differ widely from path to path
_SPREAD = 0.5  # of what is known beforehand
_DECIDING = 0.02  # of the gap
_APART = 1e-9  # m/s, by which neighbours differ at the release


def with_divergence(problem: Problem) -> Problem:
    """Return a problem whose drops know how fast their paths part, which says how far their readings are trusted."""
    rate = divergence(problem)
    return replace(problem, drops=tuple(replace(drop, divergence=rate) for drop in problem.drops))


def followable(problem: Problem, horizons: Sequence[float]) -> list[float]:
    """Return the growing horizons, s after the release, up to which a model's error does not yet decide what touches next.

    The first always, and those by which both ends have touched.
    """
    least = _least_gap(problem)
    return [
        horizon
        for horizon in horizons
        if horizon <= max(problem.stages.bounced, horizons[0])
        or all(model_error(drop, np.array(horizon)) < _DECIDING * least for drop in problem.drops)
    ]


def parting_remarks(problem: Problem, asked: Sequence[float], followed: Sequence[float]) -> tuple[str, ...]:
    """Say that drops are followed less far than was asked for, where they are."""
    if followed[-1] == asked[-1]:
        return ()
    rate = max(drop.divergence for drop in problem.drops)
    part = f"neighbouring paths of this machine part e-fold every {1e3 / rate:.0f} ms"
    if rate > USUAL_DIVERGENCE:
        part += f" (usually {1e3 / USUAL_DIVERGENCE:.0f} ms)"
    return (
        f"{part}; by {asked[len(followed)] * 1e3:g} ms the error of a path, which grows so, is"
        f" {100 * _DECIDING:g} % of the smallest gap ({_least_gap(problem) * 1e6:.0f} um), and decides what touches next: the"
        f" drops are fitted to {followed[-1] * 1e3:g} ms after the release instead of {asked[-1] * 1e3:g} ms",
    )


def _least_gap(problem: Problem) -> float:
    """Return the smallest radial gap of the touchdown bearings by the machine file, m."""
    return min(end.radial_gap.nominal for end in problem.model.machine.touchdown_bearings)


def divergence(problem: Problem) -> float:
    """Return the rate, 1/s, by which neighbouring paths part beyond the free fall, the usual one at least.

    The median over points drawn and over all drops, from the first contact to as far as all models are followed; a neighbour
    has another velocity at the release, and falls away from the path in proportion to time even where nothing touches.

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
    """Return the rate about one path, nan where it cannot be simulated."""
    horizon = min(problem.stages.followed, problem.drops[drop].seconds)
    where = problem.columns(drop)[len(problem.shared) :]
    speeds = [c for c, p in zip(where, problem.own[drop], strict=True) if p.name.startswith("velocity")]
    apart: Array = np.zeros(1)
    try:
        path = problem.simulated(point, drop, horizon)
        for column in speeds:  # a path parts fast in one direction and slowly in another
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
