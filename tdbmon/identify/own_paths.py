"""New search for each drop's path, that is its own values, with the shared values fixed.

With these fixed the drops are independent, and each can be searched alone at small cost.  Hardest to find are the angles of both
cages: which ball lies where the shaft falls.  All pairs of angles are tried with the drop's other values solved for linearly;
full fits begin at the most promising, since little is linear after a contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.cages import adapting, circle, turning
from tdbmon.identify.least_squares import Fit, fit, fit_or_none
from tdbmon.identify.one_drop import frozen, only
from tdbmon.identify.prediction import noise_alone
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import squares

Array = NDArray[np.float64]

BEYOND = 2.0  # standard deviations of the misfit of noise alone
_PROMISING = 3  # local minima on the grid of angles, from which fits begin
_SLOPES = 2  # Jacobians per fit
_AGAIN, _GAIN = 3, 0.003  # rounds at most, and relative gain of the misfit that makes another worth it


def lost_drops(problem: Problem, found: Fit, horizon: float) -> list[int]:
    """Return the drops whose misfit exceeds noise, by the mean and variance of a chi-squared distribution."""
    lost = []
    for drop, (measured, r) in enumerate(zip(problem.drops, found.residuals, strict=True)):
        noise = noise_alone(measured, horizon)
        if squares(r) > noise + BEYOND * (2 * noise) ** 0.5:
            lost.append(drop)
    return lost


def _with_paths_sought(problem: Problem, point: Array, horizon: float, drops: Sequence[int]) -> Array:
    """Return a point with the own values of some drops fitted to its shared values.

    Parameters
    ----------
    problem : Problem
    point : (n,) array
    horizon : float
        s after the release.
    drops : sequence of int

    Raises
    ------
    InputError
        If a drop cannot be simulated at the point.
    """
    moved = point.copy()
    own = problem.crew.apart(_best_own_values, [(problem, point, drop, horizon) for drop in drops])
    for drop, values in zip(drops, own, strict=True):
        moved[problem.columns(drop)[len(problem.shared) :]] = values
    return moved


def begun_at(problem: Problem, point: Array, horizon: float) -> Fit | None:
    """Return a fit begun at a point after a search of the drops' paths; None where it cannot be simulated."""
    try:
        return fit(problem, _with_paths_sought(problem, point, horizon, range(len(problem.drops))), horizon)
    except InputError:
        return None


def better_paths(problem: Problem, found: Fit, horizon: float, drops: Sequence[int]) -> Fit:
    """Return a fit begun with the paths of some drops searched anew, or the given fit where that is no better."""
    try:
        sought = fit(problem, _with_paths_sought(problem, found.point, horizon, drops), horizon)
    except InputError:
        return found
    return min(found, sought, key=lambda each: each.misfit)


def best_paths(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return a fit with the paths of lost drops (`lost_drops`) searched repeatedly, as long as that gains.

    A path that is found changes the shared values, and with these another lost path may be found.
    """
    for _ in range(_AGAIN):
        lost = lost_drops(problem, found, horizon)
        sought = better_paths(problem, found, horizon, lost) if lost else found
        if sought.misfit > (1 - _GAIN) * found.misfit:
            return sought
        found = sought
    return found


def _best_own_values(problem: Problem, point: Array, drop: int, horizon: float) -> Array:
    """Return a drop's own values at the least misfit found."""
    count = len(problem.shared)
    alone = frozen(only(problem, [drop]), point[:count])
    start = np.concatenate([np.zeros(count), point[problem.columns(drop)[count:]]])
    stays = fit(alone, start, horizon, _SLOPES)
    tried = [fit_or_none(alone, each, horizon, _SLOPES) for each in _promising_points(alone, stays, horizon)]
    best = min([stays, *(each for each in tried if each is not None)], key=lambda each: each.misfit)
    return best.point[count:]


def _promising_points(alone: Problem, stays: Fit, horizon: float) -> list[Array]:
    """Return the most promising points of a drop over its angles, with all else solved for linearly."""
    count = len(alone.shared)
    angles = [count + k for k in turning(alone)]
    others = np.arange(len(stays.point)) >= count
    others[angles] = False
    left_of = adapting(stays.residuals[0], stays.slopes[0], others, alone.prior)
    grids = [circle(alone, alone.parameters[angle])[0] for angle in angles]
    points, misfit = {}, np.full([len(grid) for grid in grids], np.inf)
    for at in np.ndindex(misfit.shape):
        points[at] = stays.point.copy()
        points[at][angles] += [grid[k] for grid, k in zip(grids, at, strict=True)]
    found = alone.residuals_at(list(points.values()), 0, horizon)
    for at, residual in zip(points, found, strict=True):
        if residual is not None:
            misfit[at] = left_of(residual, points[at])
    hollow = np.isfinite(misfit)
    for axis, step in product(range(misfit.ndim), (-1, 1)):
        hollow &= misfit <= np.roll(misfit, step, axis)
    hollow[(0,) * misfit.ndim] = False  # the present angles
    places = sorted(zip(*np.nonzero(hollow), strict=True), key=lambda at: misfit[at])
    return [points[at] for at in places[:_PROMISING]]
