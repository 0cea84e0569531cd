"""Slowing of the rotor after paths have diverged: the shaft's angle over the rest of the record, measured less simulated.

The shaft's position can be followed for some tens of milliseconds only, since paths with impacts diverge.  Its angle can be
followed much longer: until the inner rings turn with the shaft, friction removes the same speed whatever the sequence of
impacts.  The lag behind a coasting rotor is multiplied by a fitted factor, the same in all drops, since polar inertia and
friction at small loads are uncertain.  So is the drag, within the machine file's tolerance, where a drive holds the speed up to
the release: some tens of milliseconds hardly determine a decay of many seconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from tdbsim import state_layout
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.prediction import Prediction, coasting, is_driven, predict
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

# after the release, end of the stretch that is evaluated: later only drag slows the rotor
LAST_S = 0.6
_WINDOW_S = 0.02  # over which angles are averaged
_LEAST_WINDOWS = 5  # per drop
_ANGLE_SIGMA = 0.005  # rad, of a window's mean: the simulated path is one of many
_LAG_SIGMA = 0.02  # of the lag, for the same reason
_LIMIT = 400.0  # most that one window may add to the misfit
_LEAST_FACTOR, _GREATEST_FACTOR = 0.5, 3.0  # of the simulated lag
_COASTING_STEPS = 200
_ROWS = ("lag", "drag", "left", "sigma")
_KNOWN = 0.02  # relative standard deviation of the drag, below which it counts as known
_CAUGHT_UP = 0.9  # of the shaft's speed, from which on a ring hardly slips


@dataclass(frozen=True)
class Factors:
    """Factors on the simulated lag and drag, the same in all drops."""

    lag: float
    drag: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Slowing:
    """Shaft angle of a drop after the horizon, averaged over w windows.

    Attributes
    ----------
    time : (w,) array
        Middle of each window, s after the release.
    left : (w,) array
        Measured less simulated shaft angle, forward, rad.
    lag : (w,) array
        Simulated angle less that of a coasting rotor without contact, forward, rad.
    drag : (w,) array
        Angle of a coasting rotor less that of one at constant speed, forward, rad.
    held : (w,) array
        Change of angle per unit of constant deceleration since the release, forward, s^2: minus half the square of the time.
    sigma : (w,) array
        Standard deviation of `left`, rad.
    slips : (w,) array of bool
        Whether all simulated inner rings are still clearly slower than the shaft up to there: friction alone slows it then,
        whatever the rings' inertia.
    drag_sigma : float
        Relative standard deviation of the drag; 0 where the stretch before the release determines it.
    """

    time: Array
    left: Array
    lag: Array
    drag: Array
    held: Array
    sigma: Array
    slips: NDArray[np.bool_]
    drag_sigma: float = 0.0

    def rest(self, factors: Factors) -> Array:
        """Return the residual (w,), rad, with factors on the simulated lag and drag."""
        return self.left - (factors.lag - 1) * self.lag - (factors.drag - 1) * self.drag

    def during(self, windows: NDArray[np.bool_]) -> Slowing:
        """Return the slowing restricted to some windows (w,), a mask."""
        rows = {each.name: getattr(self, each.name)[windows] for each in fields(self) if each.name != "drag_sigma"}
        return Slowing(**rows, drag_sigma=self.drag_sigma)

    def misfit(self, factors: Factors) -> float:
        """Return the sum of squared residuals in units of their standard deviations, that of each window limited."""
        return float(np.minimum((self.rest(factors) / self.sigma) ** 2, _LIMIT).sum())


def last_of(drop: MeasuredDrop) -> float:
    """Return the end of the evaluated stretch of a record, s after the release."""
    return min(drop.seconds - 0.002, LAST_S)


def slowing_of(problem: Problem, point: Array, drop: int, horizon: float) -> Slowing | None:
    """Return the slowing of a drop at a point of a fit; None if keyphasor or record do not suffice or it cannot be simulated."""
    measured = problem.drops[drop]
    last = last_of(measured)
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
    coasted = _coasting_angle(model, speed, since - release)
    lag, drag = sense * turned - coasted, coasted - 2 * math.pi * speed * (since - release)
    left = sense * (angle - simulated)
    held = -0.5 * np.clip(since - release, 0.0, None) ** 2
    caught_up = _caught_up(prediction, time)
    rows = []
    for begin, end in spans:
        inside = (since >= begin) & (since < end)
        noise = measured.pulse_sigma / math.sqrt(inside.sum())
        rows.append([(begin + end) / 2, *(each[inside].mean() for each in (left, lag, drag, held)), noise])
    middle, apart, behind, dragged, holding, noise_of = np.array(rows).T
    sigma = np.sqrt(noise_of**2 + _ANGLE_SIGMA**2 + (_LAG_SIGMA * behind) ** 2)
    slips = middle + _WINDOW_S / 2 < caught_up
    return Slowing(
        time=middle,
        left=apart,
        lag=behind,
        drag=dragged,
        held=holding,
        sigma=sigma,
        slips=slips,
        drag_sigma=_drag_sigma(problem),
    )


def _caught_up(prediction: Prediction, since: Array) -> float:
    """Return when the first inner ring comes near the shaft's speed, s; infinite where none does."""
    state, n = prediction.motion.state, prediction.motion.model.n
    rings, shaft = np.abs(state[:, state_layout.ring_speeds(n)]), np.abs(state[:, state_layout.omega(n)])
    near = (rings >= _CAUGHT_UP * shaft[:, None]).any(axis=1)
    return float(since[np.argmax(near)]) if near.any() else math.inf


def _coasting_angle(model: DropModel, speed: float, since: Array) -> Array:
    """Return the angle (k,), rad, that a free rotor of an initial speed, Hz, turns in times (k,), s."""
    grid = np.linspace(0.0, max(float(since.max()), 1e-3), _COASTING_STEPS + 1)
    step, omega, angle = grid[1], 2 * math.pi * speed, [0.0]
    for _ in grid[1:]:
        middle = omega + coasting(model, omega) * step / 2
        angle.append(angle[-1] + middle * step)
        omega += coasting(model, middle) * step
    return np.interp(since, grid, angle)


def factors_of(slowings: Sequence[Slowing]) -> Factors:
    """Return the least-squares factors on simulated lag and drag of drops, that of the lag within bounds."""
    lag, drag, left, sigma = (np.concatenate([getattr(s, name) for s in slowings]) for name in _ROWS)
    known = max(each.drag_sigma for each in slowings)
    power, along = float(np.sum((lag / sigma) ** 2)), np.sum(lag * left / sigma**2)
    if known:  # eliminate the factor of the drag
        of_drag = float(np.sum((drag / sigma) ** 2)) + known**-2
        shared = float(np.sum(drag * lag / sigma**2)) / of_drag
        power -= shared**2 * of_drag
        along -= shared * np.sum(drag * left / sigma**2)
    if power == 0.0:
        return Factors(1.0)
    factor = float(np.clip(1 + along / power, _LEAST_FACTOR, _GREATEST_FACTOR))
    if not known:
        return Factors(factor)
    return Factors(factor, 1 + float(np.sum(drag * (left - (factor - 1) * lag) / sigma**2)) / of_drag)


def slowing_misfit(slowings: Sequence[Slowing]) -> float:
    """Return the sum of squares of drops at the best factors on lag and drag, the prior of the drag included."""
    factors, known = factors_of(slowings), max(each.drag_sigma for each in slowings)
    against = ((factors.drag - 1) / known) ** 2 if known else 0.0
    return sum(each.misfit(factors) for each in slowings) + against


def stated_drag_sigma(machine: Machine) -> float:
    """Return the relative standard deviation of a machine's drag from its file."""
    decay = machine.rotor.speed_decay_time
    return (decay.high - decay.low) / 4 / decay.nominal if decay is not None else 0.0


def _drag_sigma(problem: Problem) -> float:
    """Return the same combined with the decelerations before the releases; 0 where the drag then counts as known."""
    stated = stated_drag_sigma(problem.model.machine)
    if stated == 0.0:
        return 0.0
    told = [_deceleration_significance(drop, problem.model) for drop in problem.drops]
    sigma = 1 / math.sqrt(stated**-2 + sum(each**2 for each in told))
    return sigma if sigma > _KNOWN else 0.0


def _deceleration_significance(drop: MeasuredDrop, model: DropModel) -> float:
    """Return the deceleration before a release in standard deviations; 0 where a drive holds the speed."""
    return 0.0 if is_driven(drop, coasting(model, drop.omega)) else abs(drop.acceleration) / drop.acceleration_sigma


def slowings_at(problem: Problem, point: Array, horizon: float) -> tuple[Slowing, ...] | None:
    """Return the slowing of all drops at a point of a fit; None where that of one is unknown."""
    found = [slowing_of(problem, point, drop, horizon) for drop in range(len(problem.drops))]
    known = tuple(each for each in found if each is not None)
    return known if len(known) == len(found) else None
