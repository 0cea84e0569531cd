"""Fits begun at other ball clearances.

The shaft touches the ring at the radial gap plus half the diametral clearance, so the first contacts hardly separate the two.
The load sharing of the balls does, but it is periodic in the cage angles, and a descent along this valley ends long before its
bottom.  So fits begin at all four corners of the prior range of both ends' clearances, with the gaps compensated and the cage
angles searched, and the one with the least misfit is kept.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.cages import turn_cages
from tdbmon.identify.least_squares import Fit, fit, fit_or_none
from tdbmon.identify.own_paths import begun_at
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_CORNER = 1.2  # standard deviations from the nominal clearance
_SLOPES = 4  # Jacobians per fit
_GAIN = 0.1  # of the misfit beyond noise


def better_clearances(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return the best of a fit and of those begun at other clearances.

    Parameters
    ----------
    problem : Problem
    found : Fit
        With a Jacobian good enough for the search of the cage angles.
    horizon : float
        s after the release, late enough for both ends to have touched.
    """
    tried = problem.crew.apart(
        _begun_at, [(problem, found, corner, horizon) for corner in corners(problem, found.point)]
    )
    best = min([found, *(each for each in tried if each is not None)], key=lambda each: each.misfit)
    return best if best is found else fit(problem, best.point, horizon, slopes=best.slopes)


def corners(problem: Problem, point: Array) -> list[Array]:
    """Return a point moved to all corners of the clearances' prior range; none where they are not free."""
    ends = _free_ends(problem)
    if not ends:
        return []
    return [
        _with_clearances(problem, point, dict(zip(ends, signs, strict=True)))
        for signs in product((-_CORNER, _CORNER), repeat=len(ends))
    ]


def beside(problem: Problem, found: Fit, horizon: float) -> list[Fit]:
    """Return fits begun with one clearance a standard deviation to either side; none where they are not free."""
    starts = [(problem, start, horizon, _SLOPES) for start in _neighbours(problem, found.point)]
    return [each for each in problem.crew.apart(fit_or_none, starts) if each is not None]


def led_along(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return the best of a fit and of those begun at neighbouring clearances after a new search of each drop's own values.

    Where all else is right, a wrong clearance goes with wrong cage angles: neither can be corrected without the other.  This
    costs as much as all other fits to the horizon.  Where it has gained next to nothing (`hardly_gained`), it gains nothing at
    later horizons either.
    """
    starts = [(problem, start, horizon) for start in _neighbours(problem, found.point)]
    tried = problem.crew.apart(begun_at, starts)
    return min([found, *(each for each in tried if each is not None)], key=lambda each: each.misfit)


def hardly_gained(before: Fit, after: Fit, noise: float) -> bool:
    """Return whether the misfit beyond noise has fallen by next to nothing."""
    return before.misfit - after.misfit <= _GAIN * max(before.misfit - noise, 0.0)


def _neighbours(problem: Problem, point: Array) -> list[Array]:
    names = [p.name for p in problem.shared]
    return [
        _with_clearances(problem, point, {end: point[names.index(f"{end}.diametral_clearance")] + side})
        for end in _free_ends(problem)
        for side in (-1.0, 1.0)
    ]


def _free_ends(problem: Problem) -> list[str]:
    names = [p.name for p in problem.shared]
    return [end for end in problem.model.machine.ends if f"{end}.diametral_clearance" in names]


def _with_clearances(problem: Problem, point: Array, clearances: dict[str, float]) -> Array:
    """Return a point with other clearances (coordinates), each gap reduced by half of the increase of its clearance."""
    names = [p.name for p in problem.shared]
    moved = point.copy()
    for end, clearance in clearances.items():
        at = names.index(f"{end}.diametral_clearance")
        wider = (clearance - point[at]) * problem.shared[at].scale
        moved[at] = clearance
        if f"{end}.radial_gap" in names:
            gap = names.index(f"{end}.radial_gap")
            moved[gap] -= wider / 2 / problem.shared[gap].scale
    return np.clip(moved, problem.low, problem.high)


def _begun_at(problem: Problem, found: Fit, corner: Array, horizon: float) -> Fit | None:
    """Return a fit begun at a corner after a search of the cage angles; None where it cannot be simulated."""
    residuals = problem.all_residuals(corner, horizon)
    if residuals is None:
        return None
    there = turn_cages(problem, replace(found, point=corner, residuals=tuple(residuals)), horizon)
    return fit_or_none(problem, there, horizon, _SLOPES)
