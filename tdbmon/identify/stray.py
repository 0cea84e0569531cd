"""New search for the path of a single stray drop, one that fails while the others fit.

The others determine the shared values, so only the stray drop's own are open, above all the angles of its cages and rings at
the release: which ball or lobe the shaft fell on.  Fits of this drop alone begin at angles all round, at the first contacts, and
the best are continued.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.cages import circle, turning
from tdbmon.identify.least_squares import Fit, fit, fit_or_none
from tdbmon.identify.one_drop import coordinates, frozen, only
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_APART = 1.3  # times the greatest misfit ratio among the others
_GO_ON = (0.018, 12), (0.027, 4)  # horizon, s in a usual gap, and number of angles kept there


def stray_drop(found: Fit, sound: float) -> int | None:
    """Return the stray drop, or None: its misfit ratio is far above that of all others, and these are explained.

    Parameters
    ----------
    found : Fit
    sound : float
        Misfit ratio up to which drops count as explained.
    """
    left = found.ratio_of_drops
    worst = int(np.argmax(left))
    others = np.delete(left, worst)
    if others.size == 0 or others.mean() > sound or left[worst] <= max(_APART * others.max(), sound):
        return None
    return worst


def led_back(problem: Problem, found: Fit, stray: int, horizon: float) -> Fit:
    """Return a fit with the stray drop's path searched anew, or the given fit where that is no better.

    Parameters
    ----------
    problem : Problem
    found : Fit
        With a Jacobian good enough for another step.
    stray : int
        Index of the stray drop.
    horizon : float
        s after the release.
    """
    others = [drop for drop in range(len(problem.drops)) if drop != stray]
    count, point = len(problem.shared), found.point.copy()
    where = coordinates(problem, others)
    try:
        slopes = [found.slopes[drop] for drop in others]
        taught = fit(only(problem, others), point[where], horizon, 1, slopes=slopes)
        point[where] = taught.point
        alone = frozen(only(problem, [stray]), taught.point[:count])
        own = np.concatenate([np.zeros(count), point[problem.columns(stray)[count:]]])
        for column in turning(problem):
            own = _best_over_angle(alone, own, count + column, horizon)
        point[problem.columns(stray)[count:]] = own[count:]
        return min(found, fit(problem, point, horizon, 2), key=lambda each: each.misfit)
    except InputError:
        return found


def _best_over_angle(alone: Problem, own: Array, column: int, horizon: float) -> Array:
    """Return the best point of a drop from fits that begin with one of its angles all round."""
    offsets, _ = circle(alone, alone.parameters[column])
    points = []
    for offset in offsets:
        points.append(own.copy())
        points[-1][column] += offset
    stages = [(alone.stages.at(usual), kept) for usual, kept in _GO_ON]
    for stage, kept in (*((s, k) for s, k in stages if s < horizon), (horizon, 1)):
        tried = alone.crew.apart(fit_or_none, [(alone, each, stage, 2) for each in points])
        reached = sorted((each for each in tried if each is not None), key=lambda each: each.misfit)
        if not reached:
            raise InputError("the drop cannot be simulated at any angle")
        points = [each.point for each in reached[:kept]]
    return points[0]
