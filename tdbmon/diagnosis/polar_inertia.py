"""What the gyroscopic motion of the shaft tells of the rotor's polar inertia."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tdbmon.diagnosis.beside_values import beside_values
from tdbmon.diagnosis.contender import Contender
from tdbmon.identify.problem import Problem

_NUDGE = 0.01  # of it, to each side


@dataclass(frozen=True)
class PolarInertia:
    """The polar inertia that the shaft's motion wants, as a multiple of that of the machine file, and its standard deviation."""

    factor: float
    sigma: float


def polar_inertia(contender: Contender) -> PolarInertia | None:
    """Return the polar inertia by which the shaft tilts and bends sideways; None where that cannot be simulated.

    It is the end of one linear step from a fit whose values, free as they are there, make up for it as well as they can.  How
    fast the rotor slows has no part in it.
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
    """Return a problem whose rotor has gyroscopic moments of another polar inertia, and the same resistance to slowing."""
    model = problem.model
    return replace(problem, model=replace(model, arrays=model.arrays._replace(gyro=factor * model.arrays.gyro)))
