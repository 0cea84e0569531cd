"""A problem with more free parameters, and a fit carried over to it at their nominal values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tdbmon.identify.least_squares import Fit, misfit_of
from tdbmon.identify.parameters import Parameter
from tdbmon.identify.problem import Problem


def widened(
    problem: Problem, found: Fit, horizon: float, shared: Sequence[Parameter], each: Sequence[Sequence[Parameter]]
) -> tuple[Problem, Fit]:
    """Return a problem with more parameters, and a fit's point in it with residuals and Jacobian, not yet minimised.

    Parameters
    ----------
    problem : Problem
        It already simulates with these parameters at their nominal values.
    found : Fit
        With a Jacobian good enough for another step.
    horizon : float
        s after the release.
    shared : sequence of Parameter
        Appended to the shared parameters.
    each : sequence of sequence of Parameter
        Appended to the per-drop parameters, one sequence per drop.

    Raises
    ------
    InputError
        If it cannot be simulated at the point.
    """
    wider = replace(
        problem,
        shared=(*problem.shared, *shared),
        own=tuple((*own, *more) for own, more in zip(problem.own, each, strict=True)),
    )
    count, width = len(problem.shared), len(problem.own[0])
    parts = [found.point[:count], np.zeros(len(shared))]
    for drop, more in enumerate(each):
        begin = count + drop * width
        parts += [found.point[begin : begin + width], np.zeros(len(more))]
    point = np.concatenate(parts)
    new = {p.name for p in (*shared, *each[0])}
    linear = wider.each(lambda drop: wider.slopes(point, drop, horizon, new))
    slopes = []
    for drop, (_, added) in enumerate(linear):
        old = np.array([p.name not in new for p in (*wider.shared, *wider.own[drop])])
        added[:, old] = found.slopes[drop]
        slopes.append(added)
    residuals = tuple(r for r, _ in linear)
    return wider, Fit(point, residuals, tuple(slopes), misfit_of(wider, residuals, point))
