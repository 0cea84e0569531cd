"""Slopes of a drop's residuals by differences, the drop and what nudges make of it simulated side by side.

The drop itself is simulated beside them once more: what a nudge does not change, before the first touch for one, is then the
same to the last bit.  Each takes the steps that it would take alone.
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
    common, beside = shared(*case), []
    for nudged in _nudges(problem, point, drop, horizon, among, side):
        if nudged.case is not None and common is not None and shared(*nudged.case) == common:
            beside.append((nudged, nudged.case))
            continue
        try:
            moved = motion if nudged.case is None else run(*nudged.case)
        except InputError:
            continue
        jacobian[:, nudged.column] = (residuals_of(moved, nudged.sensors) - base) / nudged.step
    found = _in_batches([case, *(each for _, each in beside)]) if beside else iter([motion])
    still = next(found)
    unmoved = base if isinstance(still, InputError) else residuals_of(still, sensors)
    for (nudged, _), each in zip(beside, found, strict=True):
        if not isinstance(each, InputError):
            jacobian[:, nudged.column] = (residuals_of(each, nudged.sensors) - unmoved) / nudged.step
    return base, jacobian


def _in_batches(cases: Sequence[Case]) -> Iterator[Trajectory | InputError]:
    """Yield drops side by side, a batch after the other, so that not all states are held at once."""
    for first in range(0, len(cases), MOST):
        yield from run_side_by_side(cases[first : first + MOST])


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
