"""Several drops of one machine as one least-squares problem: parameter vector, residuals and Jacobian."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from tdbsim.drop_model import DropModel, build_model, with_effects
from tdbsim.effect import Effect
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.sensors import SensorChain
from tdbsim.stated_effects import all_effects

from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import MeasuredDrop, straight_shaft
from tdbmon.identify.free_effect import FreeEffect
from tdbmon.identify.parameters import (
    EDGE,
    Parameter,
    drop_parameters,
    machine_parameters,
    sensor_parameters,
    with_values,
)
from tdbmon.identify.prediction import Prediction, Sensors, planned, predict, readings, residuals
from tdbmon.identify.slopes import Nudged, slopes
from tdbmon.identify.stages import Stages, stages_of
from tdbmon.identify.variants import Variant, left_by, paths

Array = NDArray[np.float64]
T = TypeVar("T")

BENDING = 12  # modes per plane: with eight the truncation error is 1.6 um after 60 ms, with twelve 0.13 um


@dataclass(frozen=True, eq=False)
class Simulated:
    """A drop simulated at a point of the fit (SI); p probes, k samples.

    Attributes
    ----------
    prediction : Prediction
    span : slice
        Samples of the record that were simulated.
    since : (k,) array
        s after the first guess of the release.
    readings : (p, k) array
        Simulated readings, m.
    left : (p, k) array
        Measured less simulated readings, m; NaN where a sample is missing.
    """

    prediction: Prediction
    span: slice
    since: Array
    readings: Array
    left: Array

    @property
    def left_after(self) -> Array:
        """Measured less simulated readings from the release on, m."""
        return self.left[:, self.since >= 0]


@dataclass(frozen=True, eq=False)
class Problem:
    """A least-squares problem.

    Its coordinates are deviations from the nominal values in units of each parameter's scale: the shared ones first, then those
    of each drop.

    Attributes
    ----------
    model : DropModel
        At the machine's nominal values, without effects.
    drops : tuple of MeasuredDrop
    shared : tuple of Parameter
        Of machine and sensors.
    own : tuple of tuple of Parameter
        Per-drop parameters, one tuple per drop, all of one length.
    crew : Crew
        Runs several drops in parallel.
    free : tuple of FreeEffect
        Effects whose parameters are among the free ones.
    standing : tuple of Effect
        Effects of the machine file.
    to_the_bottom : bool
        Whether searches continue with central differences where one-sided ones no longer gain
        (`tdbmon.identify.least_squares.fit`).
    """

    model: DropModel
    drops: tuple[MeasuredDrop, ...]
    shared: tuple[Parameter, ...]
    own: tuple[tuple[Parameter, ...], ...]
    crew: Crew
    free: tuple[FreeEffect, ...] = ()
    standing: tuple[Effect, ...] = ()
    to_the_bottom: bool = False

    @cached_property
    def stages(self) -> Stages:
        """Horizons to which models are fitted and judged."""
        return stages_of(self.model.machine)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, in the order of the vector."""
        return (*self.shared, *(each for own in self.own for each in own))

    @cached_property
    def low(self) -> Array:
        """Lower bounds."""
        return np.array([(p.low - p.nominal) / p.scale for p in self.parameters])

    @cached_property
    def high(self) -> Array:
        """Upper bounds."""
        return np.array([(p.high - p.nominal) / p.scale for p in self.parameters])

    @cached_property
    def prior(self) -> Array:
        """Weight of each prior: 1, or 0 without one."""
        return np.array([1.0 if math.isfinite(p.sigma) else 0.0 for p in self.parameters])

    @property
    def start(self) -> Array:
        """The nominal values."""
        return np.zeros(len(self.parameters))

    def at_bound(self, point: Array) -> NDArray[np.bool_]:
        """Return which coordinates of a point are at a bound."""
        return np.asarray((point <= self.low + EDGE) | (point >= self.high - EDGE))

    def columns(self, drop: int) -> NDArray[np.intp]:
        """Return the indices of the coordinates that a drop depends on."""
        return self._columns[drop]

    @cached_property
    def _columns(self) -> tuple[NDArray[np.intp], ...]:
        shared, width = np.arange(len(self.shared)), len(self.own[0])
        begins = [len(shared) + drop * width for drop in range(len(self.own))]
        return tuple(np.concatenate([shared, np.arange(begin, begin + width)]) for begin in begins)

    @cached_property
    def _names(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Names of the shared and of the per-drop parameters, the latter the same in every drop."""
        return tuple(p.name for p in self.shared), tuple(p.name for p in self.own[0])

    @cached_property
    def _nominal(self) -> Array:
        return np.array([p.nominal for p in self.parameters])

    @cached_property
    def _scale(self) -> Array:
        return np.array([p.scale for p in self.parameters])

    def values(self, point: Array, drop: int) -> tuple[dict[str, float], dict[str, float]]:
        """Return the shared values and a drop's own (SI) by name."""
        shared, own = self._names
        where = self.columns(drop)
        numbers = (self._nominal[where] + self._scale[where] * point[where]).tolist()
        return (
            dict(zip(shared, numbers[: len(shared)], strict=True)),
            dict(zip(own, numbers[len(shared) :], strict=True)),
        )

    def setting(
        self, shared: Mapping[str, float], own: Mapping[str, float], drop: int
    ) -> tuple[DropModel, tuple[Effect, ...]]:
        """Return the model at a drop's values, with its effects (raises InputError where they are impossible)."""
        model = with_values(self.model, shared)
        effects = (*self.standing, *(each.at(shared, own, drop) for each in self.free))
        return (with_effects(model, effects) if effects else model), effects

    def sensors(
        self, effects: Sequence[Effect], shared: Mapping[str, float], own: Mapping[str, float], drop: int
    ) -> Sensors:
        """Return the sensors of a drop."""
        chain = SensorChain()
        for effect in effects:
            chain = effect.sense(chain, self.model.machine, 1 / self.drops[drop].interval)
        return Sensors(chain, shared, own)

    def _setup_at(self, point: Array, drop: int) -> tuple[DropModel, dict[str, float], Sensors]:
        """Return the model, a drop's own values and its sensors at a point (raises InputError where that is impossible)."""
        shared, own = self.values(point, drop)
        model, effects = self.setting(shared, own, drop)
        return model, own, self.sensors(effects, shared, own, drop)

    def residual(self, point: Array, drop: int, horizon: float) -> Array:
        """Return a drop's residuals (raises InputError where the values are impossible)."""
        model, own, sensors = self._setup_at(point, drop)
        prediction = predict(self.drops[drop], model, own, horizon)
        return residuals(prediction.path, self.drops[drop], self.model.machine, sensors)

    def variant(self, point: Array, drop: int, horizon: float) -> Variant:
        """Return the variant of a drop at a point (raises InputError where the values are impossible)."""
        model, own, sensors = self._setup_at(point, drop)
        return Variant(model, planned(self.drops[drop], own, horizon), sensors)

    def residuals_at(self, points: Sequence[Array], drop: int, horizon: float) -> list[Array | None]:
        """Return a drop's residuals at several points; None where the values are impossible."""
        variants: dict[int, Variant] = {}
        for at, point in enumerate(points):
            try:
                variants[at] = self.variant(point, drop, horizon)
            except InputError:
                continue
        measured = self.drops[drop]
        found = paths(measured, list(variants.values()), horizon)
        left = left_by(measured, self.model.machine, found, [each.sensors for each in variants.values()])
        reached = dict(zip(variants, left, strict=True))
        return [reached.get(at) for at in range(len(points))]

    def simulated(self, point: Array, drop: int, horizon: float) -> Simulated:
        """Return a drop simulated at a point (raises InputError where the values are impossible)."""
        measured = self.drops[drop]
        model, own, sensors = self._setup_at(point, drop)
        prediction = predict(measured, model, own, horizon)
        seen = readings(prediction.path, measured, self.model.machine, sensors)
        span = slice(prediction.path.first, prediction.path.first + seen.shape[1])
        since = measured.time[span] - measured.release
        return Simulated(prediction, span, since, seen, measured.reading[:, span] - seen)

    def all_residuals(self, point: Array, horizon: float) -> list[Array] | None:
        """Return the residuals of all drops, or None where the values are impossible."""
        try:
            return self.each(lambda drop: self.residual(point, drop, horizon))
        except InputError:
            return None

    def slopes(
        self, point: Array, drop: int, horizon: float, among: Collection[str] | None = None, side: int = 1
    ) -> tuple[Array, Array]:
        """Return a drop's residuals (m,) and Jacobian (m, columns) by one-sided differences, `side` 1 or -1.

        Only the columns of parameters named in `among` are computed where that is given, the others left zero.
        """
        base = self.variant(point, drop, horizon)
        nudged = list(self._nudges(base, point, drop, horizon, among, side))
        return slopes(self.drops[drop], self.model.machine, base, nudged, len(self.columns(drop)), horizon)

    def _nudges(
        self, base: Variant, point: Array, drop: int, horizon: float, among: Collection[str] | None, side: int
    ) -> Iterator[Nudged]:
        """Yield the drop with each free parameter moved in turn, except those whose moved value is impossible."""
        shared, own = self.values(point, drop)
        acting_names = {each.name for each in self.free}
        parameters = (*self.shared, *self.own[drop])
        for k, (column, parameter) in enumerate(zip(self.columns(drop), parameters, strict=True)):
            stays = self.low[column] == self.high[column]
            if stays or (among is not None and parameter.name not in among):
                continue
            step = side * parameter.nudge
            if not self.low[column] <= point[column] + step <= self.high[column]:
                step = -step
            of_all = k < len(self.shared)
            value = {parameter.name: float(self._nominal[column] + self._scale[column] * (point[column] + step))}
            values = (shared | value, own) if of_all else (shared, own | value)
            model, acting, plan = base.model, base.model.effects, base.plan
            try:
                if of_all or parameter.name.rpartition(".")[0] in acting_names:
                    model, acting = self.setting(*values, drop)
                elif parameter.moves:
                    plan = planned(self.drops[drop], values[1], horizon)
                sensors = self.sensors(acting, *values, drop)
                variant = Variant(model, plan, sensors) if parameter.moves else replace(base, sensors=sensors)
                yield Nudged(k, step, variant)
            except InputError:
                continue

    def linearised(self, point: Array, horizon: float, sides: Sequence[int]) -> list[tuple[Array, Array]]:
        """Return `slopes` of every drop, the Jacobian averaged over the sides: with both, central differences."""
        count = len(self.drops)
        found = self.crew.apart(
            Problem.slopes, [(self, point, drop, horizon, None, side) for side in sides for drop in range(count)]
        )
        return [(found[drop][0], np.mean([s for _, s in found[drop::count]], axis=0)) for drop in range(count)]

    def each(self, work: Callable[[int], T]) -> list[T]:
        """Apply a function to every drop, several in parallel."""
        return self.crew.together(work, range(len(self.drops)))


def build_problem(machine: Machine, drops: tuple[MeasuredDrop, ...], crew: Crew) -> Problem:
    """Return the problem of a machine at its nominal values, with the effects of its file.

    Raises
    ------
    InputError
        If the nominal values cannot be simulated.
    """
    plain = machine.model_copy(update={"effects": ()})
    own = tuple(drop_parameters(machine, _set_point(machine, drop), drop.angle, drop.angle_sigma) for drop in drops)
    shared = (*machine_parameters(machine), *sensor_parameters(machine))
    return Problem(build_model(plain, bending=BENDING), drops, shared, own, crew, standing=all_effects(machine))


def _set_point(machine: Machine, drop: MeasuredDrop) -> Array:
    """Return each end's levitated mean position (x, y) from the probes' means by least squares (2, 2), m."""
    means = np.array([n.mean for n in drop.noise])
    axes = np.diag([cmath.rect(1.0, -probe.angle) for probe in drop.probes])
    solution, *_ = np.linalg.lstsq(straight_shaft(machine, drop.probes, axes), means, rcond=None)
    return np.asarray(solution, dtype=float).reshape(2, 2)


def check_start(problem: Problem, horizon: float) -> None:
    """Raise InputError, with the record's name, if a drop cannot be simulated at the nominal values."""
    for drop, measured in enumerate(problem.drops):
        try:
            problem.residual(problem.start, drop, horizon)
        except InputError as error:
            raise InputError(
                f"{measured.name}: cannot be simulated with the machine's nominal values: {error}"
            ) from None
