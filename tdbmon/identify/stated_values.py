"""Values that a machine file states without tolerance, free in a fit after all; and which of them it had to move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import OUTSIDE
from tdbmon.identify.parameters import stated_parameters
from tdbmon.identify.problem import Problem

WORTH = 0.5  # of what is left beyond noise, that they must take away to be free
_TOLD = 1.0  # standard deviation, from which on it is told


def eased(problem: Problem) -> Problem:
    """Return a problem whose machine's values may move too that its file states without tolerance, after the shared ones."""
    return replace(problem, shared=(*problem.shared, *stated_parameters(problem.model.machine)))


def stated_remarks(problem: Problem, point: NDArray[np.float64]) -> list[str]:
    """Return what there is to say of the stated values at a point of a fit: which had to move, where they were free."""
    values, _ = problem.values(point, 0)
    moved = []
    for p in stated_parameters(problem.model.machine):
        if p.name in values and abs(values[p.name] - p.nominal) > _TOLD * p.sigma:
            factor = OUTSIDE[p.unit]
            unit = "" if p.unit == "1" else f" {p.unit}"
            moved.append(f"{p.name} {factor * values[p.name]:.4g} instead of {factor * p.nominal:.4g}{unit}")
    if not moved:
        return []
    return [
        "the drops are followed better with values that the machine file states without tolerance moved within what is"
        f" usually known of them: {', '.join(moved)}. The drops tell such values one by one only roughly"
    ]
