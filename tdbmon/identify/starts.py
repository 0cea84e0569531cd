"""Other places to start from: cages turned, ball clearances narrow and wide.

A contact depends on the cages' angles in a wavy way, so they are searched over all of a ball's spacing, everything else
adapting linearly.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.problem import Problem, huber, spread

Array = NDArray[np.float64]

_CLEARANCE_START = 1.0  # standard deviations from the nominal clearance, at which other starts begin
_WORTH = 0.9  # of what is left at the present angle, that another must get below
_CAGE_GRID = 8  # angles tried over a ball's spacing, an end


def best_start(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return the best of several starts, each fitted: narrow and wide ball clearances, cages turned to suit.

    A wider clearance with a narrower gap lets the rotor fall as far; the first contact alone hardly tells them apart.
    """
    index = {p.name: k for k, p in enumerate(problem.shared)}
    pairs = []
    for bearing in problem.model.machine.touchdown_bearings:
        clearance, gap = (index.get(f"{bearing.name}.{f}") for f in ("diametral_clearance", "radial_gap"))
        if clearance is not None and gap is not None:
            pairs.append((clearance, gap, 0.5 * problem.shared[clearance].scale / problem.shared[gap].scale))
    fitted = [found]
    for signs in product((-_CLEARANCE_START, _CLEARANCE_START), repeat=len(pairs)) if pairs else ():
        other = found.point.copy()
        for (clearance, gap, ratio), sign in zip(pairs, signs, strict=True):
            other[gap] -= ratio * (sign - found.point[clearance])
            other[clearance] = sign
        try:
            moved = fit(problem, np.clip(other, problem.low, problem.high), horizon, 1)
            fitted.append(fit(problem, turn_cages(problem, moved, horizon), horizon, 2, slopes=moved.slopes))
        except InputError:
            continue
    return min(fitted, key=lambda each: each.misfit)


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
