"""How the rotor slows after paths have parted: the shaft's angle to the end of the record, measured less simulated.

Where the shaft is in its gap can be followed for some tens of milliseconds only, since paths with impacts part.  How far it
has turned can be followed much longer: friction takes as much speed away however the impacts fall, until the inner rings
turn with the shaft.  The lag behind a rotor that only coasts counts with a factor of its own, the same in all drops: it is
as uncertain as polar inertia and friction at small loads are.  So does the drag, within the machine file's tolerance, where a
drive holds the speed up to the release: some tens of milliseconds tell little of a decay of many seconds.
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

# after the release, as far as the rest of a record is looked at: what slows a rotor later is drag alone
LAST_S = 0.6
_WINDOW_S = 0.02  # over which angles are averaged
_LEAST_WINDOWS = 5  # of a drop
_ANGLE_SIGMA = 0.005  # rad, of a mean: the simulated path is one of many
_LAG_SIGMA = 0.02  # of the lag, for the same reason
_LIMIT = 400.0  # that one window may add to the misfit
_LEAST_FACTOR, _GREATEST_FACTOR = 0.5, 3.0  # of the simulated lag
_COASTING_STEPS = 200
_ROWS = ("lag", "drag", "left", "sigma")
_TOLD = 0.02  # standard deviation of the drag before the release, as a share of it: less is as good as nothing
_CAUGHT_UP = 0.9  # of the shaft's speed, from which on a ring hardly slips


@dataclass(frozen=True)
class Factors:
    """By which the simulated lag and drag count, the same in all drops."""

    lag: float
    drag: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
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
    held : (w,) array
        Angle that each rad/s^2 of slowing from the release on takes, forward, s^2: half the square of the time.
    sigma : (w,) array
        Standard deviation of what is left, rad.
    slips : (w,) array of bool
        Whether all inner rings still turn plainly slower than the shaft up to there, as simulated: friction alone slows it then,
        whatever the rings' inertia.
    drag_sigma : float
        By which share the drag may be off, standard deviation; 0 where it is told before the release.
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
        """Return what is left, rad, where simulated lag and drag count by factors."""
        return self.left - (factors.lag - 1) * self.lag - (factors.drag - 1) * self.drag

    def during(self, windows: NDArray[np.bool_]) -> Slowing:
        """Return the same of some windows (w,) only."""
        rows = {each.name: getattr(self, each.name)[windows] for each in fields(self) if each.name != "drag_sigma"}
        return Slowing(**rows, drag_sigma=self.drag_sigma)

    def misfit(self, factors: Factors) -> float:
        """Return the sum of squares in units of their standard deviations."""
        return float(np.minimum((self.rest(factors) / self.sigma) ** 2, _LIMIT).sum())


def last_of(drop: MeasuredDrop) -> float:
    """Return up to when the rest of a record is looked at, s after the release."""
    return min(drop.seconds - 0.002, LAST_S)


def slowing_of(problem: Problem, point: Array, drop: int, horizon: float) -> Slowing | None:
    """Return how a drop slows at a point of a fit; None without a keyphasor, a longer record, or a simulation."""
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
    coasted = _coasted(model, speed, since - release)
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
    """Return when the first of the inner rings comes near the shaft's speed, s; infinite where none does."""
    state, n = prediction.motion.state, prediction.motion.model.n
    rings, shaft = np.abs(state[:, state_layout.ring_speeds(n)]), np.abs(state[:, state_layout.omega(n)])
    near = (rings >= _CAUGHT_UP * shaft[:, None]).any(axis=1)
    return float(since[np.argmax(near)]) if near.any() else math.inf


def _coasted(model: DropModel, speed: float, since: Array) -> Array:
    """Return the angle, rad, that a rotor of a speed, Hz, turns in times (k,), s, where nothing touches it."""
    grid = np.linspace(0.0, max(float(since.max()), 1e-3), _COASTING_STEPS + 1)
    step, omega, angle = grid[1], 2 * math.pi * speed, [0.0]
    for _ in grid[1:]:
        middle = omega + coasting(model, omega) * step / 2
        angle.append(angle[-1] + middle * step)
        omega += coasting(model, middle) * step
    return np.interp(since, grid, angle)


def factors_of(slowings: Sequence[Slowing]) -> Factors:
    """Return the factors of simulated lag and drag with which drops leave least, that of the lag within bounds."""
    lag, drag, left, sigma = (np.concatenate([getattr(s, name) for s in slowings]) for name in _ROWS)
    known = max(each.drag_sigma for each in slowings)
    power, along = float(np.sum((lag / sigma) ** 2)), np.sum(lag * left / sigma**2)
    if known:  # what the drag may take of it
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
    """Return the sum of squares of drops, where simulated lag and drag count by the factors that suit them best."""
    factors, known = factors_of(slowings), max(each.drag_sigma for each in slowings)
    against = ((factors.drag - 1) / known) ** 2 if known else 0.0
    return sum(each.misfit(factors) for each in slowings) + against


def stated_drag_sigma(machine: Machine) -> float:
    """Return by which share the drag of a machine may be off by its file, standard deviation."""
    decay = machine.rotor.speed_decay_time
    return (decay.high - decay.low) / 4 / decay.nominal if decay is not None else 0.0


def _drag_sigma(problem: Problem) -> float:
    """Return the same beside what the levitated shafts tell of it; 0 where that is enough."""
    stated = stated_drag_sigma(problem.model.machine)
    if stated == 0.0:
        return 0.0
    told = [_coasting_told(drop, problem.model) for drop in problem.drops]
    sigma = 1 / math.sqrt(stated**-2 + sum(each**2 for each in told))
    return sigma if sigma > _TOLD else 0.0


def _coasting_told(drop: MeasuredDrop, model: DropModel) -> float:
    """Return of how many standard deviations the deceleration before a release is; 0 where a drive holds the speed."""
    return 0.0 if is_driven(drop, coasting(model, drop.omega)) else abs(drop.acceleration) / drop.acceleration_sigma


def slowings_at(problem: Problem, point: Array, horizon: float) -> tuple[Slowing, ...] | None:
    """Return the same at a point of a fit."""
    found = [slowing_of(problem, point, drop, horizon) for drop in range(len(problem.drops))]
    known = tuple(each for each in found if each is not None)
    return known if len(known) == len(found) else None
