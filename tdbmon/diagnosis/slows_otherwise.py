"""Whether a rotor slows otherwise than a model has it, and what that may be."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from tdbsim.columns import INERTIA
from tdbsim.machine import Machine

from tdbmon.diagnosis.contender import Contender
from tdbmon.identify.slowing import Slowing, slowing_misfit, slowings_at

_DRAG_SIGMA = 0.02  # of the drag, at least
_PLAINLY, _CERTAINLY = 0.15, 5.0  # off 1, and in standard deviations: a factor of the lag that is told
WORTH = 60.0  # sum of squares from which on a cause is sought
_PLAINLY_SLOWS = 2 * WORTH  # the same from which on it is the likeliest cause there is


def slows_otherwise(contender: Contender) -> bool:
    """True where a rotor plainly slows otherwise than a model has it."""
    slowings = slowings_of(contender)
    return slowings is not None and slowing_misfit(slowings) > _PLAINLY_SLOWS


def slowing_remarks(contender: Contender) -> list[str]:
    """Return what there is to say of how fast the rotor slows, where it is plainly not as simulated."""
    slowings = slowings_of(contender)
    if slowings is None:
        return []
    factor, sigma = lag_beside_drag(slowings, contender.problem.model.machine)
    if abs(factor - 1) < max(_PLAINLY, _CERTAINLY * sigma):
        return []
    inertia = float(contender.problem.model.arrays.spin[INERTIA])
    where = ", in all drops" if len(slowings) > 1 else ""
    return [
        f"the contacts slow the shaft {factor:.2f} times as much as simulated{where}, and a drag within its tolerance does not"
        f" explain that: the rotor's polar inertia ({inertia:.4g} kg m^2 by the machine file), that of the inner rings, or"
        " friction at small loads may not be as the file has it. The verdict does not rest on it"
    ]


def lag_beside_drag(slowings: Sequence[Slowing], machine: Machine) -> tuple[float, float]:
    """Return the factor of the lag and its standard deviation, where the machine's drag may be off by its tolerance.

    Some tens of milliseconds tell little of a decay of many seconds, and an error of it counts by the square of the time.
    """
    known = _known_drag(machine)
    columns = ("lag", "drag", "left", "sigma")
    lag, drag, left, sigma = (np.concatenate([getattr(s, name) for s in slowings]) for name in columns)
    design = np.column_stack([lag, drag]) / sigma[:, None]
    covariance = np.linalg.pinv(design.T @ design + np.diag([0.0, known**-2]))
    off, _ = covariance @ design.T @ (left / sigma)
    return 1 + float(off), math.sqrt(covariance[0, 0])


def _known_drag(machine: Machine) -> float:
    """Return the standard deviation of a rotor's drag beside that of the fit, as a share of it."""
    decay = machine.rotor.speed_decay_time
    tolerance = (decay.high - decay.low) / 4 / decay.nominal if decay is not None else 0.0
    return max(tolerance, _DRAG_SIGMA)


def slowings_of(contender: Contender) -> tuple[Slowing, ...] | None:
    """Return how all drops slow as a model has it; None where that of one is not known."""
    return slowings_at(contender.problem, contender.fit.point, contender.horizon)
