"""Whether a rotor slows otherwise than a model predicts, and possible reasons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.columns import INERTIA
from tdbsim.machine import Machine
from tdbsim.rotor import build_rotor

from tdbmon.analysis.braked import most_friction
from tdbmon.diagnosis.contender import HARDLY, NEARLY, Contender
from tdbmon.diagnosis.polar_inertia import polar_inertia
from tdbmon.identify.slowing import Slowing, slowing_misfit, slowings_at, stated_drag_sigma

_DRAG_SIGMA = 0.02  # least relative standard deviation of the drag
_AS_STATED = 1e-6  # the same of a drag that is held
_TELLS = 0.05  # greatest standard deviation at which a polar inertia counts as determined
_AS_TURNED = 0.02  # greatest deviation from 1 of a confirmed polar inertia
_LEAST_SLIPPING = 2  # windows of a drop in which its rings slip
_PLAINLY, _CERTAINLY = (
    0.15,
    5.0,
)  # deviation of the lag's factor from 1 that is reported; the same in standard deviations
WORTH = 60.0  # sum of squares from which on a cause is sought
_TAKES_AWAY = 0.25  # share of the misfit that a torque may leave: friction, which ends with the slip, leaves more
_PLAINLY_SLOWS = 2 * WORTH  # sum of squares above which another slowing is the likeliest cause


def slows_otherwise(contender: Contender) -> bool:
    """True if the rotor clearly slows otherwise than a model predicts."""
    slowings = slowings_of(contender)
    return slowings is not None and slowing_misfit(slowings) > _PLAINLY_SLOWS


@dataclass(frozen=True)
class SlowsOtherwise:
    """How a rotor slows otherwise than a model predicts.

    Attributes
    ----------
    remarks : tuple of str
        Empty if nothing is clear.
    driven : bool
        Whether the drops slow as if by a torque that acts from the release on.
    """

    remarks: tuple[str, ...] = ()
    driven: bool = False


def slowing_beside(contender: Contender) -> SlowsOtherwise:
    """Return how the rotor slows, if that is clearly not as simulated."""
    slowings = slowings_of(contender)
    if slowings is None:
        return SlowsOtherwise()
    machine = contender.problem.model.machine
    torques = torques_beside_lag(slowings, contender)
    if torques is not None:
        return SlowsOtherwise((torque_in_words(torques, machine),), driven=not _is_drag(torques, machine))
    if contender.ratio > NEARLY:  # wrong contacts also change the slowing
        return SlowsOtherwise()
    factor, sigma = lag_beside_drag(slowings, machine)
    if abs(factor - 1) < max(_PLAINLY, _CERTAINLY * sigma):
        return SlowsOtherwise()
    where = ", in all drops" if len(slowings) > 1 else ""
    return SlowsOtherwise(
        (
            f"the contacts slow the shaft {factor:.2f} times as much as simulated{where}, and a drag within its tolerance does"
            f" not explain that. {_why_so(factor, slowings, contender)}. The verdict does not rest on it",
        )
    )


def _why_so(factor: float, slowings: Sequence[Slowing], contender: Contender) -> str:
    """Return what speaks for and against each reason for a factor of the lag: polar inertia, the rings' inertia, friction."""
    inertia = float(contender.problem.model.arrays.spin[INERTIA])
    rotor = f"The rotor's polar inertia ({inertia:.4g} kg m^2 by the machine file)"
    told = polar_inertia(contender) if contender.ratio < HARDLY * contender.floor else None
    if told is None or told.sigma > _TELLS:
        rotor = f"{rotor} may be wrong; these drops do not determine it"
    elif abs(told.factor - 1) < max(_AS_TURNED, _CERTAINLY * told.sigma):
        off = 100 * (abs(told.factor - 1) + 2 * told.sigma)
        rotor = f"{rotor} does not explain it either: the shaft's gyroscopic motion confirms it to {off:.1g} %"
    else:
        rotor = f"{rotor} is wrong: the shaft's gyroscopic motion requires {told.factor:.2f} times as much"
        if abs(told.factor * factor - 1) < _PLAINLY:
            return f"{rotor}, which explains it"
    slip = _while_rings_slip(slowings, contender.problem.model.machine)
    if slip is None:
        return f"{rotor}. The inertia of the inner rings or friction at small loads may differ from the file"
    early, sigma = slip
    if abs(early - factor) < max(_PLAINLY, _CERTAINLY * sigma):
        beside = ". Something else than the journals may rub, or at a larger radius, such as a shoulder on a ring's face"
        return (
            f"{rotor}. Inertia and drag of the inner rings do not explain it: it is already {early:.2f} times while the rings"
            f" slip, when friction alone slows the shaft{beside if factor > 1 else ''}"
        )
    much = "more" if factor > early else "less"
    return (
        f"{rotor}. While the inner rings slip it is {early:.2f} times, so the rings need {much} torque to turn than by the file:"
        " check their inertia, with that of balls and cage, or their drag"
    )


def _while_rings_slip(slowings: Sequence[Slowing], machine: Machine) -> tuple[float, float] | None:
    """Return the factor of the lag while all rings slip, and its standard deviation; None if too uncertain."""
    early = [each.during(each.slips) for each in slowings if each.slips.sum() >= _LEAST_SLIPPING]
    if not early:
        return None
    found = lag_beside_drag(early, machine)
    return found if found[1] < _PLAINLY else None


def lag_beside_drag(slowings: Sequence[Slowing], machine: Machine) -> tuple[float, float]:
    """Return the factor of the lag and its standard deviation, with the machine's drag free within its tolerance.

    Some tens of milliseconds hardly determine a decay over many seconds, whose error grows with the square of time.
    """
    found, covariance, _ = _solved(slowings, _known_drag(machine), torques=False)
    return 1 + float(found[0]), math.sqrt(covariance[0, 0])


def torques_beside_lag(slowings: Sequence[Slowing], contender: Contender) -> NDArray[np.float64] | None:
    """Return the torque, N m, that slows each drop from the release on in addition to lag and drag; None without a clear one.

    The lag by contacts grows until the rings turn with the shaft; that by a torque grows with the square of time.  A torque is
    clear if it has the same sign in all drops and takes away most of the misfit.
    """
    machine = contender.problem.model.machine
    *_, without = _solved(slowings, _known_drag(machine), torques=False)
    found, covariance, left = _solved(slowings, _known_drag(machine), torques=True)
    rates, sigmas = found[2:], np.sqrt(np.diag(covariance)[2:])
    told = bool((rates > _CERTAINLY * sigmas).all() or (rates < -_CERTAINLY * sigmas).all())
    if not told or without < _PLAINLY_SLOWS or left > _TAKES_AWAY * without:
        return None
    # with the drag held as stated: else a torque that grows as the rotor slows would pass for a greater one with less drag
    rates = _solved(slowings, _AS_STATED, torques=True)[0][2:]
    return rates * float(contender.problem.model.arrays.spin[INERTIA])


def _solved(
    slowings: Sequence[Slowing], drag_sigma: float, torques: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Fit the relative errors of lag and drag and, with `torques`, a further deceleration of each drop, rad/s^2.

    Returns these with their covariance and the remaining sum of squares, the prior of the drag included.
    """
    columns = ("lag", "drag", "held", "left", "sigma")
    lag, drag, held, left, sigma = (np.concatenate([getattr(s, name) for s in slowings]) for name in columns)
    drops = np.concatenate([np.full(len(s.time), i) for i, s in enumerate(slowings)])
    rates = [np.where(drops == i, held, 0.0) for i in range(len(slowings))] if torques else []
    design = np.column_stack([lag, drag, *rates]) / sigma[:, None]
    known = np.zeros(design.shape[1])
    known[1] = drag_sigma**-2
    covariance = np.linalg.pinv(design.T @ design + np.diag(known))
    found = covariance @ design.T @ (left / sigma)
    return found, covariance, float(np.sum((left / sigma - design @ found) ** 2) + known @ found**2)


def torque_in_words(torques: NDArray[np.float64], machine: Machine) -> str:
    """Return possible reasons for the torques of `torques_beside_lag`, N m, in words."""
    low, high = sorted((float(np.abs(torques).min()), float(np.abs(torques).max())))
    size = f"{low:.2g} to {high:.2g} N m" if f"{low:.2g}" != f"{high:.2g}" else f"{high:.2g} N m"
    if _is_drag(torques, machine):
        said = (
            f"lags as if slowed by a torque of {size}, and the machine file states no speed_decay_time, so the model has no drag:"
            " state it."
        )
    elif torques[0] < 0:
        said = f"runs ahead as if driven by a torque of {size}: does the drive stay on?"
    else:
        most, friction = most_friction(machine, build_rotor(machine))
        asked = (
            f"more than friction in the contacts gives ({most:.2g} N m at a friction of {friction:g}): does the drive brake?"
            if high > most
            else "in addition to drag and contacts: does the drive brake, or are the rings hard to turn?"
        )
        said = f"lags as if slowed by an extra torque of {size}, {asked}"
    return f"from the release on the shaft {said} The verdict does not rest on it"


def _is_drag(torques: NDArray[np.float64], machine: Machine) -> bool:
    """True if the torque may be drag, for which the machine file states no decay time."""
    return bool(torques[0] > 0) and machine.rotor.speed_decay_time is None


def _known_drag(machine: Machine) -> float:
    """Return the prior relative standard deviation of the rotor's drag."""
    return max(stated_drag_sigma(machine), _DRAG_SIGMA)


def slowings_of(contender: Contender) -> tuple[Slowing, ...] | None:
    """Return the slowing of all drops against a model; None if that of one is unknown."""
    return slowings_at(contender.problem, contender.fit.point, contender.horizon)
