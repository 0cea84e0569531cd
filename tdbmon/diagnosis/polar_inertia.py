"""The rotor's polar inertia, from the gyroscopic motion of the shaft."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tdbmon.diagnosis.beside_values import beside_values
from tdbmon.diagnosis.contender import Contender
from tdbmon.identify.problem import Problem

_NUDGE = 0.01  # relative step of the central difference


@dataclass(frozen=True)
class PolarInertia:
    """The polar inertia that fits the shaft's motion, as a multiple of the machine file's, and its standard deviation."""

    factor: float
    sigma: float


def polar_inertia(contender: Contender) -> PolarInertia | None:
    """Return the polar inertia from the gyroscopic tilting and bending of the shaft; None if that cannot be simulated.

    One linear step from the fit, in which the free values compensate for it as well as they can.  The slowing of the rotor plays
    no part.
    """
    problem, fit = contender.problem, contender.fit
    more, less = (
        _with_gyroscopics(problem, 1 + side).all_residuals(fit.point, contender.horizon) for side in (_NUDGE, -_NUDGE)
    )
    if more is None or less is None:
        return None
    beside = beside_values(problem, fit)
    slope = beside.of([(a - b) / (2 * _NUDGE) for a, b in zip(more, less, strict=True)])
    power = float(slope @ slope)
    if power == 0.0:
        return None
    return PolarInertia(1 - float(slope @ beside.left) / power, power**-0.5)


def _with_gyroscopics(problem: Problem, factor: float) -> Problem:
    """Return the problem with the gyroscopic moments scaled, and the inertia against slowing unchanged."""
    model = problem.model
    return replace(problem, model=replace(model, arrays=model.arrays._replace(gyro=factor * model.arrays.gyro)))
