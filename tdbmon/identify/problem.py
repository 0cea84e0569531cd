"""Several drops of one machine as one problem of least squares: one vector, its residuals and their slopes."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError

from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.parameters import Parameter, with_values
from tdbmon.identify.prediction import predict, residuals

Array = NDArray[np.float64]
T = TypeVar("T")

_ROBUST = 3.0  # times the spread: from there on a residual counts linearly (Huber)


@dataclass(frozen=True, eq=False)
class Problem:
    """Coordinates count from the nominal values in units of each parameter's scale: shared ones first, then a drop's own.

    Attributes
    ----------
    model : DropModel
        At the machine's nominal values.
    drops : tuple of MeasuredDrop
    shared : tuple of Parameter
        Of machine and sensors.
    own : tuple of tuple of Parameter
        A tuple a drop, all of one length.
    pool : Executor
        Works on several drops at a time.
    """

    model: DropModel
    drops: tuple[MeasuredDrop, ...]
    shared: tuple[Parameter, ...]
    own: tuple[tuple[Parameter, ...], ...]
    pool: Executor

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All, in the order of the vector."""
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
        """Weight of what is known beforehand: 1, or 0 where nothing is."""
        return np.array([1.0 if math.isfinite(p.sigma) else 0.0 for p in self.parameters])

    @property
    def start(self) -> Array:
        """The nominal values."""
        return np.zeros(len(self.parameters))

    def columns(self, drop: int) -> NDArray[np.intp]:
        """Return which coordinates a drop depends on."""
        width = len(self.own[0])
        begin = len(self.shared) + drop * width
        return np.concatenate([np.arange(len(self.shared)), np.arange(begin, begin + width)])

    def values(self, point: Array, drop: int) -> tuple[dict[str, float], dict[str, float]]:
        """Return shared values and a drop's own (SI) by name."""
        inside = point[self.columns(drop)]
        parameters = (*self.shared, *self.own[drop])
        numbers = [p.nominal + p.scale * z for p, z in zip(parameters, inside, strict=True)]
        count = len(self.shared)
        return (
            {p.name: x for p, x in zip(self.shared, numbers[:count], strict=True)},
            {p.name: x for p, x in zip(self.own[drop], numbers[count:], strict=True)},
        )

    def residual(self, point: Array, drop: int, horizon: float) -> Array:
        """Return a drop's residuals (raises InputError where the values are impossible)."""
        shared, own = self.values(point, drop)
        measured = self.drops[drop]
        prediction = predict(measured, with_values(self.model, shared), own, horizon)
        return residuals(prediction, measured, self.model.machine, shared, own)

    def all_residuals(self, point: Array, horizon: float) -> list[Array] | None:
        """Return the residuals of all drops, or None where the values are impossible."""
        try:
            return self.each(lambda drop: self.residual(point, drop, horizon))
        except InputError:
            return None

    def slopes(self, point: Array, drop: int, horizon: float) -> tuple[Array, Array]:
        """Return a drop's residuals (m,) and their slopes (m, columns) by differences."""
        measured, machine = self.drops[drop], self.model.machine
        shared, own = self.values(point, drop)
        model = with_values(self.model, shared)
        prediction = predict(measured, model, own, horizon)
        base = residuals(prediction, measured, machine, shared, own)
        where = self.columns(drop)
        jacobian = np.empty((len(base), len(where)))
        for k, (column, parameter) in enumerate(zip(where, (*self.shared, *self.own[drop]), strict=True)):
            step = parameter.nudge if point[column] + parameter.nudge <= self.high[column] else -parameter.nudge
            near = point.copy()
            near[column] += step
            moved_shared, moved_own = self.values(near, drop)
            moved = prediction
            if parameter.moves:
                try:
                    moved_model = with_values(self.model, moved_shared) if k < len(self.shared) else model
                    moved = predict(measured, moved_model, moved_own, horizon)
                except InputError:
                    jacobian[:, k] = 0.0
                    continue
            jacobian[:, k] = (residuals(moved, measured, machine, moved_shared, moved_own) - base) / step
        return base, jacobian

    def linearised(self, point: Array, horizon: float) -> list[tuple[Array, Array]]:
        """Return `slopes` of every drop."""
        return self.each(lambda drop: self.slopes(point, drop, horizon))

    def each(self, work: Callable[[int], T]) -> list[T]:
        """Do something for every drop, several at a time."""
        return list(self.pool.map(work, range(len(self.drops))))


def spread(residual: Array) -> float:
    """Return how many times wider than expected the residuals are, robustly; at least 1."""
    return max(1.0, 1.4826 * float(np.median(np.abs(residual))))


def huber(residual: Array, scale: float) -> Array:
    """Return the weights of residuals: 1/scale^2, less for those beyond three times it."""
    away = np.abs(residual) / scale
    return np.minimum(1.0, _ROBUST / np.maximum(away, 1e-12)) / scale**2
