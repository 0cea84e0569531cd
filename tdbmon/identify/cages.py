"""Cages turned to where they suit.

A contact depends on the cages' angles in a wavy way, so they are searched over all of a ball's spacing, everything else
adapting linearly.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.least_squares import Fit
from tdbmon.identify.problem import Problem, huber, spread

Array = NDArray[np.float64]

_WORTH = 0.9  # of what is left at the present angle, that another must get below
_CAGE_GRID = 8  # angles tried over a ball's spacing, an end


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


def _turned(problem: Problem, found: Fit, drop: int, horizon: float, cages: list[int]) -> Array:
    """Return the best angles of a drop's cages, in the coordinates of the point."""
    where = problem.columns(drop)
    base, jacobian = found.residuals[drop], found.slopes[drop]
    others = ~np.isin(np.arange(len(where)), cages)
    weights, prior = np.sqrt(huber(base, spread(base))), problem.prior[where][others]
    basis, _ = np.linalg.qr(np.vstack([jacobian[:, others] * weights[:, None], np.diag(prior)]))
    near = found.point.copy()
    numbered = any(each.each_held for each in problem.free)
    for cage in cages:
        start, least, best = near[where[cage]], math.inf, near[where[cage]]
        stays = math.inf
        for angle in start + np.arange(_CAGE_GRID) * 2 / _CAGE_GRID:  # two of its scales are a ball's spacing
            near[where[cage]] = angle
            try:
                left = problem.residual(near, drop, horizon) * weights
            except InputError:
                continue
            left = np.concatenate([left, near[where][others] * prior])
            left = left - basis @ (basis.T @ left)
            if angle == start:
                stays = float(left @ left)
            if float(left @ left) < least:
                least, best = float(left @ left), angle
        if least > _WORTH * stays:
            best = start
        # a cage turned by whole balls is the same one, unless the balls have numbers
        near[where[cage]] = best if numbered else (best + 1) % 2 - 1
    return near[where[cages]]
