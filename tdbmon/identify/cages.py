"""Search for the angles of cages and rings at the release.

The contact forces are periodic in the cage angle, so it is searched over a whole ball spacing, with all other parameters
solved for linearly.  The phases, at the release, of lobes and waves that turn with a ring are searched likewise.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.parameters import Parameter
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber, spread

Array = NDArray[np.float64]

_WORTH = 0.9  # of the misfit at the present angle: another angle must get below it
_GRID = 8  # angles tried per ball spacing
_NUMBERED_GRID = 4  # the same where one ball differs from the others, so that the whole circle is searched
_PHASES = 8  # tried per period of a lobe or wave that turns with a ring


def turn_cages(problem: Problem, found: Fit, horizon: float) -> Array:
    """Return the fitted point with each drop's cages and rings at the angles of least misfit, the rest solved for linearly.

    The angles are searched one after the other, since the first contacts of the two ends hardly affect each other.
    """
    point = found.point.copy()
    columns = [len(problem.shared) + k for k in turning(problem)]
    turned = problem.each(lambda drop: _best_angles(problem, found, drop, horizon, columns))
    for drop, angles in enumerate(turned):
        point[problem.columns(drop)[columns]] = angles
    return point


def better_cages(problem: Problem, found: Fit, horizon: float, linearisations: int) -> Fit:
    """Return the fit repeated from turned cages, or the given fit where that is no better."""
    try:
        turned = fit(problem, turn_cages(problem, found, horizon), horizon, linearisations)
    except InputError:
        return found
    return min(found, turned, key=lambda each: each.misfit)


def _best_angles(problem: Problem, found: Fit, drop: int, horizon: float, columns: list[int]) -> Array:
    """Return a drop's cage and ring angles of least misfit, in the coordinates of the point."""
    where = problem.columns(drop)
    base, jacobian = found.residuals[drop], found.slopes[drop]
    others = ~np.isin(np.arange(len(where)), columns)
    left_of = adapting(base, jacobian, others, problem.prior[where])
    near = found.point.copy()
    for column in columns:
        offsets, period = circle(problem, problem.own[drop][column - len(problem.shared)])
        start, least, best = near[where[column]], math.inf, near[where[column]]
        stays = math.inf
        turned = np.tile(near, (len(offsets), 1))
        turned[:, where[column]] += offsets
        for offset, residual in zip(offsets, problem.residuals_at(list(turned), drop, horizon), strict=True):
            if residual is None:
                continue
            left = left_of(residual, near[where])
            if offset == 0:
                stays = left
            if left < least:
                least, best = left, start + offset
        if least > _WORTH * stays:
            best = start
        near[where[column]] = (best + period / 2) % period - period / 2
    return near[where[columns]]


def adapting(
    residual: Array, slopes: Array, others: NDArray[np.bool_], prior: Array
) -> Callable[[Array, Array], float]:
    """Return a function of residuals and values of a drop: the misfit left once the other parameters are solved for linearly.

    Parameters
    ----------
    residual, slopes : (m,), (m, columns) arrays
        Residuals of the drop, which set the robust weights, and their Jacobian.
    others : (columns,) array of bool
        The parameters that are solved for.
    prior : (columns,) array
        Weight of each parameter's prior.
    """
    weights, known = np.sqrt(huber(residual, spread(residual))), prior[others]
    basis, _ = np.linalg.qr(np.vstack([slopes[:, others] * weights[:, None], np.diag(known)]))

    def left_of(residual: Array, values: Array) -> float:
        left = np.concatenate([residual * weights, values[others] * known])
        left -= basis @ (basis.T @ left)
        return float(left @ left)

    return left_of


def turning(problem: Problem) -> list[int]:
    """Return the indices of the angles of rings and cages at the release among a drop's own parameters."""
    own = [p.name for p in problem.own[0]]
    return [*(own.index(name) for name in _phases(problem)), *(own.index(f"cage_{end}") for end in range(2))]


def circle(problem: Problem, angle: Parameter) -> tuple[Array, float]:
    """Return the offsets at which such an angle is tried, and its period, both in the parameter's scale."""
    if not angle.name.startswith("cage_"):
        period = 2 * math.pi / angle.scale
        return np.arange(_PHASES) * period / _PHASES, period
    end = int(angle.name.removeprefix("cage_"))
    balls = problem.model.machine.touchdown_bearings[end].balls.count
    # a ball spacing is two scales; where the balls are numbered, the period is the whole circle
    if _numbered(problem, end):
        return np.arange(_NUMBERED_GRID * balls) * 2 / _NUMBERED_GRID, 2.0 * balls
    return np.arange(_GRID) * 2 / _GRID, 2.0


def _phases(problem: Problem) -> list[str]:
    """Return the names of the per-drop phases of effects that act on the motion."""
    return [p.name for each in problem.free for p in each.own(0) if p.moves]


def _numbered(problem: Problem, end: int) -> bool:
    """True where an effect makes the balls of an end differ from each other."""
    name = problem.model.machine.ends[end]
    if any(each.each_held and each.where in (name, "both") for each in problem.free):
        return True
    # effects of the machine file that refer to a ball by its number
    return any(
        each.where in (name, "both") and any(p.whole and p.per_drop for p in each.parameters())
        for each in problem.standing
    )
