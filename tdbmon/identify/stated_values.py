"""Stated values (those that a machine file gives without tolerance) freed in a fit, and remarks on those that had to move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.least_squares import Fit, fit
from tdbmon.identify.parameters import Parameter, stated_parameters
from tdbmon.identify.problem import Problem
from tdbmon.identify.widened import widened

WORTH = 0.5  # of the misfit beyond noise, that they must remove to be freed
_SLOPES = 3  # Jacobians per fit: with one, values that have compensated for these would hide them
_AT_LIMIT = 0.95  # of the distance to a bound, from which on a value counts as at it
_REPORTED = 1.0  # standard deviations of change, from which on a value is reported


def has_stated_values(problem: Problem) -> bool:
    """Return whether stated values are already free."""
    return bool(_free(problem))


def _free(problem: Problem) -> list[Parameter]:
    known = {p.name for p in problem.shared}
    return [each for each in stated_parameters(problem.model.machine) if each.name in known]


def with_stated_values(problem: Problem, found: Fit, horizon: float) -> tuple[Problem, Fit]:
    """Return the problem with the stated values free, and the fit's point and Jacobian in it (see `widened`)."""
    return widened(problem, found, horizon, stated_parameters(problem.model.machine), [()] * len(problem.drops))


def fitted_with_stated_values(problem: Problem, found: Fit, horizon: float) -> tuple[Problem, Fit] | None:
    """Return the problem with the stated values free, and its fit from there; None where it cannot be simulated."""
    try:
        wider, start = with_stated_values(problem, found, horizon)
        return wider, fit(wider, start.point, horizon, _SLOPES, slopes=start.slopes)
    except InputError:
        return None


def at_their_limits(problem: Problem, point: NDArray[np.float64]) -> list[str]:
    """Return the names of free stated values that are at, or nearly at, a bound."""
    values, _ = problem.values(point, 0)
    return [each.name for each in _free(problem) if _relative_deviation(each, values[each.name]) >= _AT_LIMIT]


def _relative_deviation(of: Parameter, value: float) -> float:
    """Return the deviation of a value from its nominal, relative to that of the bound on the same side."""
    reach = of.high - of.nominal if value > of.nominal else of.nominal - of.low
    return abs(value - of.nominal) / reach if reach > 0 else 0.0


def stated_remarks(problem: Problem, point: NDArray[np.float64]) -> list[str]:
    """Return a remark on free stated values that had to move at a point of a fit, if any."""
    values, _ = problem.values(point, 0)
    moved = [
        p.instead(values[p.name], p.nominal)
        for p in _free(problem)
        if abs(values[p.name] - p.nominal) > _REPORTED * p.sigma
    ]
    if not moved:
        return []
    followed, told = ("drop is", "It determines") if len(problem.drops) == 1 else ("drops are", "They determine")
    return [
        f"the {followed} followed better if values that the machine file states without tolerance move within their usual"
        f" uncertainty: {', '.join(moved)}. {told} such single values only roughly"
    ]
