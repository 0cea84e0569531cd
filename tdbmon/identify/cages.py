"""Cages turned to where they suit.

A contact depends on the cages' angles in a wavy way, so they are searched over all of a ball's spacing, everything else
adapting linearly.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.problem import Problem, huber, spread

Array = NDArray[np.float64]

_WORTH = 0.9  # of what is left at the present angle, that another must get below
_GRID = 8  # angles tried over a ball's spacing, an end
_NUMBERED_GRID = 4  # the same where one ball differs from the others, and the whole circle is searched


def turn_cages(problem: Problem, found: Fit, horizon: float) -> Array:
    """Return the fitted point with each drop's cages at the angles that suit best once all else has adapted linearly.

    Each end by itself: the ends' first contacts hardly know of each other.
    """
    point = found.point.copy()
    own = [p.name for p in problem.own[0]]
    cages = [len(problem.shared) + own.index(f"cage_{end}") for end in range(2)]
    turned = problem.each(lambda drop: _turned(problem, found, drop, horizon, cages))
    for drop, angles in enumerate(turned):
        point[problem.columns(drop)[cages]] = angles
    return point


def better_cages(problem: Problem, found: Fit, horizon: float, linearisations: int) -> Fit:
    """Return a fit with its cages turned and fitted anew, or as it was where that is no better."""
    try:
        turned = fit(problem, turn_cages(problem, found, horizon), horizon, linearisations)
    except InputError:
        return found
    return min(found, turned, key=lambda each: each.misfit)


def _turned(problem: Problem, found: Fit, drop: int, horizon: float, cages: list[int]) -> Array:
    """Return the best angles of a drop's cages, in the coordinates of the point."""
    where = problem.columns(drop)
    base, jacobian = found.residuals[drop], found.slopes[drop]
    others = ~np.isin(np.arange(len(where)), cages)
    weights, prior = np.sqrt(huber(base, spread(base))), problem.prior[where][others]
    basis, _ = np.linalg.qr(np.vstack([jacobian[:, others] * weights[:, None], np.diag(prior)]))
    near = found.point.copy()
    for end, cage in enumerate(cages):
        numbered = _numbered(problem, end)
        balls = problem.model.machine.touchdown_bearings[end].balls.count
        # two spans are a ball's spacing; where the balls have numbers, it takes the whole circle
        offsets = np.arange(_NUMBERED_GRID * balls) * 2 / _NUMBERED_GRID if numbered else np.arange(_GRID) * 2 / _GRID
        start, least, best = near[where[cage]], math.inf, near[where[cage]]
        stays = math.inf
        for offset in offsets:
            near[where[cage]] = start + offset
            try:
                left = problem.residual(near, drop, horizon) * weights
            except InputError:
                continue
            left = np.concatenate([left, near[where][others] * prior])
            left = left - basis @ (basis.T @ left)
            if offset == 0:
                stays = float(left @ left)
            if float(left @ left) < least:
                least, best = float(left @ left), start + offset
        if least > _WORTH * stays:
            best = start
        around = balls if numbered else 1
        near[where[cage]] = (best + around) % (2 * around) - around
    return near[where[cages]]


def _numbered(problem: Problem, end: int) -> bool:
    """True where an effect makes the balls of an end differ."""
    name = problem.model.machine.ends[end]
    return any(each.each_held and each.where in (name, "both") for each in problem.free)
