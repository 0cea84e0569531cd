"""Fits begun at other clearances of the balls.

The shaft meets a ring where gap and half the clearance add up to, so the first contacts hardly tell the one from the
other; how the balls share the load does, and that depends on the cages' angles in a wavy way.  A descent along this
valley ends long before its bottom.  So fits begin at all four corners of what is known of both ends' clearances, gaps
making up for them and cages turned to suit, and the deepest is kept.
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
_SLOPES = 4  # times that each takes slopes
_GAIN = 0.1  # of what is left beyond noise


def better_clearances(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return the deepest of a fit and of those that begin at other clearances.

    Parameters
    ----------
    problem : Problem
    found : Fit
        With slopes near enough to turn the cages.
    horizon : float
        s after the release, late enough for both ends to have met their bearings.
    """
    tried = problem.crew.apart(
        _begun_at, [(problem, found, corner, horizon) for corner in corners(problem, found.point)]
    )
    best = min([found, *(each for each in tried if each is not None)], key=lambda each: each.misfit)
    return best if best is found else fit(problem, best.point, horizon, slopes=best.slopes)


def corners(problem: Problem, point: Array) -> list[Array]:
    """Return a point moved to all corners of what is known of the clearances; none where they are known exactly."""
    ends = _free_ends(problem)
    if not ends:
        return []
    return [
        _with_clearances(problem, point, dict(zip(ends, signs, strict=True)))
        for signs in product((-_CORNER, _CORNER), repeat=len(ends))
    ]


def beside(problem: Problem, found: Fit, horizon: float) -> list[Fit]:
    """Return fits that begin with one clearance a standard deviation to either side; none where they are known exactly."""
    starts = [(problem, start, horizon, _SLOPES) for start in _beside(problem, found.point)]
    return [each for each in problem.crew.apart(fit_or_none, starts) if each is not None]


def led_along(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return the deepest of a fit and of those begun beside its clearances, the drops' paths sought there first.

    Where all else is right, a wrong clearance stands with wrong angles of the cages: neither can be left without the other.
    It takes as long as all fits to that horizon: where it gained next to nothing (`hardly_gained`) it does not later on either.
    """
    starts = [(problem, start, horizon) for start in _beside(problem, found.point)]
    tried = problem.crew.apart(begun_at, starts)
    return min([found, *(each for each in tried if each is not None)], key=lambda each: each.misfit)


def hardly_gained(before: Fit, after: Fit, noise: float) -> bool:
    """Return whether a fit has lost next to nothing of what it left beyond noise."""
    return before.misfit - after.misfit <= _GAIN * max(before.misfit - noise, 0.0)


def _beside(problem: Problem, point: Array) -> list[Array]:
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
    """Return a point with other clearances, in their scales, each gap less by as much as half of it is more."""
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
    """Return a fit begun at a corner, cages turned first; None where it cannot be simulated."""
    residuals = problem.all_residuals(corner, horizon)
    if residuals is None:
        return None
    there = turn_cages(problem, replace(found, point=corner, residuals=tuple(residuals)), horizon)
    return fit_or_none(problem, there, horizon, _SLOPES)
