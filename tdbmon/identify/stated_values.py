"""Values that a machine file states without tolerance, free in a fit after all; and which of them it had to move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.parameters import Parameter, stated_parameters
from tdbmon.identify.problem import Problem
from tdbmon.identify.widened import widened

WORTH = 0.5  # of what is left beyond noise, that they must take away to be free
_SLOPES = 3  # times: with one, values that have made up for these would hide them
_AT_LIMIT = 0.95  # of the way to a limit, from which on a value is at it
_TOLD = 1.0  # standard deviation, from which on it is told


def has_stated_values(problem: Problem) -> bool:
    """Return whether these values may move already."""
    return bool(_free(problem))


def _free(problem: Problem) -> list[Parameter]:
    known = {p.name for p in problem.shared}
    return [each for each in stated_parameters(problem.model.machine) if each.name in known]


def with_stated_values(problem: Problem, found: Fit, horizon: float) -> tuple[Problem, Fit]:
    """Return a problem in which these values may move too, and a fit as it stands there (see `widened`)."""
    return widened(problem, found, horizon, stated_parameters(problem.model.machine), [()] * len(problem.drops))


def fitted_with_stated_values(problem: Problem, found: Fit, horizon: float) -> tuple[Problem, Fit] | None:
    """Return the same fitted from where it stands; None where it cannot be simulated."""
    try:
        wider, start = with_stated_values(problem, found, horizon)
        return wider, fit(wider, start.point, horizon, _SLOPES, slopes=start.slopes)
    except InputError:
        return None


def at_their_limits(problem: Problem, point: NDArray[np.float64]) -> list[str]:
    """Return the names of those that are free and at a point nearly as far off as they may be."""
    values, _ = problem.values(point, 0)
    return [each.name for each in _free(problem) if _way_to_limit(each, values[each.name]) >= _AT_LIMIT]


def _way_to_limit(of: Parameter, value: float) -> float:
    """Return how far off a value is, of as far as it may be to that side."""
    reach = of.high - of.nominal if value > of.nominal else of.nominal - of.low
    return abs(value - of.nominal) / reach if reach > 0 else 0.0


def stated_remarks(problem: Problem, point: NDArray[np.float64]) -> list[str]:
    """Return what there is to say of the stated values at a point of a fit: which had to move, where they were free."""
    values, _ = problem.values(point, 0)
    moved = [
        p.instead(values[p.name], p.nominal)
        for p in _free(problem)
        if abs(values[p.name] - p.nominal) > _TOLD * p.sigma
    ]
    if not moved:
        return []
    followed, told = ("drop is", "It tells") if len(problem.drops) == 1 else ("drops are", "They tell")
    return [
        f"the {followed} followed better with values that the machine file states without tolerance moved within what is"
        f" usually known of them: {', '.join(moved)}. {told} such values one by one only roughly"
    ]
