"""Slopes of a drop's residuals by differences, the drop and what nudges make of it simulated side by side.

The drop itself is in every batch: so it and the drops that it is compared with took the very same steps, and where a nudge
changes nothing, before the first touch for one, the difference is zero.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.side_by_side import MOST, run_side_by_side, shared
from tdbsim.simulate import DropPlan, Trajectory, run

from tdbmon.identify.prediction import Sensors, predicted, residuals, simulation

if TYPE_CHECKING:
    from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]
Case = tuple[DropModel, DropPlan]


@dataclass(frozen=True, eq=False)
class _Nudged:
    """A drop with one parameter moved a little.

    Attributes
    ----------
    column : int
        Of the parameter among those of the drop.
    step : float
        How far, in coordinates.
    case : (DropModel, DropPlan), optional
        What is to be simulated, where the nudge moves the rotor.
    sensors : Sensors
    """

    column: int
    step: float
    case: Case | None
    sensors: Sensors


def slopes(
    problem: Problem, point: Array, drop: int, horizon: float, among: Collection[str] | None, side: int
) -> tuple[Array, Array]:
    """Return a drop's residuals and their slopes, as `Problem.slopes` says."""
    measured, machine = problem.drops[drop], problem.model.machine
    values = problem.values(point, drop)
    model, effects = problem.setting(*values, drop)
    sensors = problem.sensors(effects, *values, drop)

    def residuals_of(motion: Trajectory, seen: Sensors) -> Array:
        return residuals(predicted(measured, motion, horizon), measured, machine, seen)

    case = simulation(measured, model, values[1], horizon)
    motion = run(*case)
    base = residuals_of(motion, sensors)
    jacobian = np.zeros((len(base), len(problem.columns(drop))))
    moving = []
    for nudged in _nudges(problem, point, drop, horizon, among, side):
        if nudged.case is None:
            jacobian[:, nudged.column] = (residuals_of(motion, nudged.sensors) - base) / nudged.step
        else:
            moving.append((nudged, nudged.case))
    for several, still in _simulated(case, motion, moving):
        unmoved = base if still is motion else residuals_of(still, sensors)
        for nudged, moved in several:
            jacobian[:, nudged.column] = (residuals_of(moved, nudged.sensors) - unmoved) / nudged.step
    return base, jacobian


def _nudges(
    problem: Problem, point: Array, drop: int, horizon: float, among: Collection[str] | None, side: int
) -> Iterator[_Nudged]:
    """Yield the drop with each parameter moved that may be; what cannot be set is left out."""
    values = problem.values(point, drop)
    model, effects = problem.setting(*values, drop)
    sensors = problem.sensors(effects, *values, drop)
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
        moved_values = problem.values(near, drop)
        moved, acting = model, effects
        try:
            if k < len(problem.shared) or parameter.name.partition(".")[0] in acting_names:
                moved, acting = problem.setting(*moved_values, drop)
            if parameter.moves:  # then the probes stay as they are
                probes = replace(sensors, shared=moved_values[0], own=moved_values[1])
                yield _Nudged(k, step, simulation(problem.drops[drop], moved, moved_values[1], horizon), probes)
            else:
                yield _Nudged(k, step, None, problem.sensors(acting, *moved_values, drop))
        except InputError:
            continue


def _simulated(
    case: Case, motion: Trajectory, moving: Sequence[tuple[_Nudged, Case]]
) -> Iterator[tuple[list[tuple[_Nudged, Trajectory]], Trajectory]]:
    """Yield nudged drops, simulated, and the drop as it was simulated beside them; those that cannot be are left out."""
    common = shared(*case)
    beside = [each for each in moving if common is not None and shared(*each[1]) == common]
    for first in range(0, len(beside), MOST - 1):
        batch = beside[first : first + MOST - 1]
        still, *found = run_side_by_side([case, *(nudged_case for _, nudged_case in batch)], together=True)
        if isinstance(still, InputError):
            raise still
        yield (
            [
                (nudged, each)
                for (nudged, _), each in zip(batch, found, strict=True)
                if not isinstance(each, InputError)
            ],
            still,
        )
    for nudged, nudged_case in moving:
        if common is None or shared(*nudged_case) != common:
            try:
                yield [(nudged, run(*nudged_case))], motion
            except InputError:
                continue
