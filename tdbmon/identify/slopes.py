"""Slopes of a drop's residuals by differences, the drop and what nudges make of it simulated side by side."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.prediction import planned
from tdbmon.identify.variants import Variant, changes

if TYPE_CHECKING:
    from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Nudged:
    """A drop with one parameter moved a little.

    Attributes
    ----------
    column : int
        Of the parameter among those of the drop.
    step : float
        How far, in coordinates.
    variant : Variant
    """

    column: int
    step: float
    variant: Variant


def slopes(
    problem: Problem, point: Array, drop: int, horizon: float, among: Collection[str] | None, side: int
) -> tuple[Array, Array]:
    """Return a drop's residuals and their slopes, as `Problem.slopes` says."""
    measured, machine = problem.drops[drop], problem.model.machine
    base = problem.variant(point, drop, horizon)
    nudged = list(_nudges(problem, base, point, drop, horizon, among, side))
    unmoved, changed = changes(measured, machine, base, [each.variant for each in nudged], horizon)
    jacobian = np.zeros((len(unmoved), len(problem.columns(drop))))
    for each, change in zip(nudged, changed, strict=True):
        if change is not None:
            jacobian[:, each.column] = change / each.step
    return unmoved, jacobian


def _nudges(
    problem: Problem,
    base: Variant,
    point: Array,
    drop: int,
    horizon: float,
    among: Collection[str] | None,
    side: int,
) -> Iterator[_Nudged]:
    """Yield the drop with each parameter moved that may be; what cannot be set is left out."""
    acting_names = {each.name for each in problem.free}
    parameters = (*problem.shared, *problem.own[drop])
    for k, (column, parameter) in enumerate(zip(problem.columns(drop), parameters, strict=True)):
        stays = problem.low[column] == problem.high[column]
        if stays or (among is not None and parameter.name not in among):
            continue
        step = side * parameter.nudge
        if not problem.low[column] <= point[column] + step <= problem.high[column]:
            step = -step
        near = point.copy()
        near[column] += step
        values = problem.values(near, drop)
        model, acting = base.model, base.model.effects
        try:
            if k < len(problem.shared) or parameter.name.partition(".")[0] in acting_names:
                model, acting = problem.setting(*values, drop)
            if parameter.moves:  # then the probes stay as they are
                sensors = replace(base.sensors, shared=values[0], own=values[1])
                plan = planned(problem.drops[drop], values[1], horizon)
                yield _Nudged(k, step, Variant(model, plan, sensors))
            else:
                sensors = problem.sensors(acting, *values, drop)
                yield _Nudged(k, step, replace(base, sensors=sensors))
        except InputError:
            continue
