"""How the rotor slows after paths have parted: the shaft's angle to the end of the record, measured less simulated.

Where the shaft is in its gap can be followed for some tens of milliseconds only, since paths with impacts part.  How far it
has turned can be followed much longer: friction takes as much speed away however the impacts fall, until the inner rings
turn with the shaft.  The lag behind a rotor that only coasts counts with a factor of its own, the same in all drops: it is
as uncertain as polar inertia and friction at small loads are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from tdbsim.columns import INERTIA
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.diagnosis.contender import Contender
from tdbmon.identify.prediction import coasting, predict
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_LAST_S = 0.6  # after the release; what slows a rotor later is drag alone
_WINDOW_S = 0.02  # over which angles are averaged
_LEAST_WINDOWS = 5  # of a drop
_ANGLE_SIGMA = 0.005  # rad, of a mean: the simulated path is one of many
_LAG_SIGMA = 0.02  # of the lag, for the same reason
_DRAG_SIGMA = 0.02  # of the drag, at least
_LIMIT = 400.0  # that one window may add to the misfit
_LEAST_FACTOR, _GREATEST_FACTOR = 0.5, 3.0  # of the simulated lag
_COASTING_STEPS = 200
_PLAINLY, _CERTAINLY = 0.15, 5.0  # off 1, and in standard deviations: a factor of the lag that is told
WORTH = 60.0  # sum of squares from which on a cause is sought
_PLAINLY_SLOWS = 2 * WORTH  # the same from which on it is the likeliest cause there is


@dataclass(frozen=True, eq=False)
class Slowing:
    """How a drop's shaft turned after the horizon; w windows.

    Attributes
    ----------
    time : (w,) array
        Middle of each window, s after the release.
    left : (w,) array
        Measured less simulated shaft angle, forward, rad.
    lag : (w,) array
        Simulated angle less that of a rotor that nothing touches, forward, rad.
    drag : (w,) array
        Angle of a rotor that only coasts less that of one that nothing slows, forward, rad.
    sigma : (w,) array
        Standard deviation of what is left, rad.
    """

    time: Array
    left: Array
    lag: Array
    drag: Array
    sigma: Array

    def rest(self, factor: float) -> Array:
        """Return what is left, rad, where the simulated lag counts by a factor."""
        return self.left - (factor - 1) * self.lag

    def misfit(self, factor: float) -> float:
        """Return the sum of squares in units of their standard deviations."""
        return float(np.minimum((self.rest(factor) / self.sigma) ** 2, _LIMIT).sum())


def slowing_of(problem: Problem, point: Array, drop: int, horizon: float) -> Slowing | None:
    """Return how a drop slows at a point of a fit; None without a keyphasor, a longer record, or a simulation."""
    measured = problem.drops[drop]
    last = min(measured.seconds - 0.002, _LAST_S)
    since = measured.pulse_times - measured.release
    angle, since = measured.pulse_angles[since < last], since[since < last]
    spans = [(a, b) for a, b in pairwise(np.arange(horizon, last, _WINDOW_S)) if ((since >= a) & (since < b)).any()]
    if len(spans) < _LEAST_WINDOWS:
        return None
    shared, own = problem.values(point, drop)
    try:
        model, _ = problem.setting(shared, own, drop)
        prediction = predict(measured, model, own, last)
    except InputError:
        return None
    path = prediction.path
    sense = problem.model.machine.sense
    time = measured.time[path.first : path.first + len(path.angle)] - measured.release
    simulated = np.interp(since, time, path.angle)
    release = own["release"]
    turned = simulated - np.interp(release, time, path.angle)
    speed = prediction.motion.plan.speed
    coasted = _coasted(model, speed, since - release)
    lag, drag = sense * turned - coasted, coasted - 2 * math.pi * speed * (since - release)
    left = sense * (angle - simulated)
    rows = []
    for begin, end in spans:
        inside = (since >= begin) & (since < end)
        noise = measured.pulse_sigma / math.sqrt(inside.sum())
        rows.append([(begin + end) / 2, *(each[inside].mean() for each in (left, lag, drag)), noise])
    middle, apart, behind, dragged, noise_of = np.array(rows).T
    sigma = np.sqrt(noise_of**2 + _ANGLE_SIGMA**2 + (_LAG_SIGMA * behind) ** 2)
    return Slowing(middle, apart, behind, dragged, sigma)


def _coasted(model: DropModel, speed: float, since: Array) -> Array:
    """Return the angle, rad, that a rotor of a speed, Hz, turns in times (k,), s, where nothing touches it."""
    grid = np.linspace(0.0, max(float(since.max()), 1e-3), _COASTING_STEPS + 1)
    step, omega, angle = grid[1], 2 * math.pi * speed, [0.0]
    for _ in grid[1:]:
        middle = omega + coasting(model, omega) * step / 2
        angle.append(angle[-1] + middle * step)
        omega += coasting(model, middle) * step
    return np.interp(since, grid, angle)


def lag_factor(slowings: Sequence[Slowing]) -> float:
    """Return the factor of the simulated lag with which drops leave least, within bounds."""
    lag, left, sigma = (np.concatenate([getattr(s, name) for s in slowings]) for name in ("lag", "left", "sigma"))
    power = float(np.sum((lag / sigma) ** 2))
    if power == 0.0:
        return 1.0
    return float(np.clip(1 + np.sum(lag * left / sigma**2) / power, _LEAST_FACTOR, _GREATEST_FACTOR))


def slows_otherwise(contender: Contender) -> bool:
    """True where a rotor plainly slows otherwise than a model has it."""
    slowings = slowings_of(contender)
    return slowings is not None and slowing_misfit(slowings) > _PLAINLY_SLOWS


def slowing_remarks(contender: Contender) -> list[str]:
    """Return what there is to say of how fast the rotor slows, where it is plainly not as simulated."""
    slowings = slowings_of(contender)
    if slowings is None:
        return []
    machine = contender.problem.model.machine
    factor, sigma = _factor_beside_drag(slowings, _known_drag(machine))
    if abs(factor - 1) < max(_PLAINLY, _CERTAINLY * sigma):
        return []
    inertia = float(contender.problem.model.arrays.spin[INERTIA])
    where = ", in all drops" if len(slowings) > 1 else ""
    return [
        f"after the release the shaft falls behind one that only coasts by {factor:.2f} times what is simulated{where}, beside a"
        " drag that may be off by its tolerance:"
        f" the rotor's polar inertia ({inertia:.4g} kg m^2 by the machine file), that of the inner rings, or friction at"
        " small loads may not be as the file has it. The verdict does not rest on it"
    ]


def _factor_beside_drag(slowings: Sequence[Slowing], known: float) -> tuple[float, float]:
    """Return the factor of the lag and its standard deviation, where the drag is known to a share of it only.

    Some tens of milliseconds tell little of a decay of many seconds, and an error of it counts by the square of the time.
    """
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


def slowing_misfit(slowings: Sequence[Slowing]) -> float:
    """Return the sum of squares of drops, where the simulated lag counts by the factor that suits them best."""
    factor = lag_factor(slowings)
    return sum(each.misfit(factor) for each in slowings)


def slowings_of(contender: Contender) -> tuple[Slowing, ...] | None:
    """Return how all drops slow as a model has it; None where that of one is not known."""
    return slowings_at(contender.problem, contender.fit.point, contender.horizon)


def slowings_at(problem: Problem, point: Array, horizon: float) -> tuple[Slowing, ...] | None:
    """Return the same at a point of a fit."""
    found = [slowing_of(problem, point, drop, horizon) for drop in range(len(problem.drops))]
    known = tuple(each for each in found if each is not None)
    return known if len(known) == len(found) else None
