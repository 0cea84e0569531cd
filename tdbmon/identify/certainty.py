"""Covariance of a fitted point, widened by the fit's misfit beyond noise.

With a right model at its global minimum, residuals would be noise alone and the curvature would give the covariance.  But with
impacts the misfit is rugged: fits end in narrow local minima, and no model is quite right.  The misfit beyond noise measures
both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import Machine

from tdbmon.estimate import Z95
from tdbmon.identify.clearances import beside
from tdbmon.identify.follow import Passed
from tdbmon.identify.least_squares import information
from tdbmon.identify.own_paths import BEYOND
from tdbmon.identify.parameters import stated_parameters
from tdbmon.identify.prediction import Values, noise_alone, touched_rows
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber, squares
from tdbmon.identify.stated_values import with_stated_values

Array = NDArray[np.float64]


def drift(passed: Sequence[Passed], settled: float) -> Array:
    """Return the mean outer product (n, n) of the distances of fits to shorter horizons from the last.

    With a right model they would differ by their noise; errors of the model pull them apart.
    """
    *earlier, last = passed
    points = [each.fit.point for each in earlier if each.horizon > settled]
    total = np.zeros((len(last.fit.point), len(last.fit.point)))
    for each in points:
        total += np.outer(each - last.fit.point, each - last.fit.point) / len(points)
    return total


def reach(problem: Problem, passed: Sequence[Passed]) -> Array:
    """Return the covariance (n, n) of the last fit, its 95 % intervals widened to where the true values may lie.

    Contacts that a fit does not explain say nothing about its values.  These rest on the contacts before, and so on the last
    fit that left noise alone.
    """
    beyond = [_beyond(problem, each) for each in passed]
    lost = next((k for k, (more, usual) in enumerate(beyond) if more > usual), len(passed))
    rest, (more, _) = passed[max(lost - 1, 0)], beyond[max(lost - 1, 0)]
    return drift(passed, problem.stages.sound) + _with_stated_values(problem, rest, more) + _valley(problem, rest, more)


def _beyond(problem: Problem, passed: Passed) -> tuple[float, float]:
    """Return a fit's misfit beyond noise, and how much of that may be chance (two standard deviations of chi-squared)."""
    noise = [noise_alone(drop, passed.horizon) for drop in problem.drops]
    left = [squares(r) for r in passed.fit.residuals]
    return sum(max(0.0, a - b) for a, b in zip(left, noise, strict=True)), BEYOND * math.sqrt(2 * sum(noise))


def _with_stated_values(problem: Problem, passed: Passed, beyond: float) -> Array:
    """Return `_allowed` with the values that the machine file states without tolerance uncertain too.

    A fit that holds them as stated compensates for their errors with the values that are free.
    """
    stated = {p.name for p in stated_parameters(problem.model.machine)}
    if not stated.isdisjoint(p.name for p in problem.shared):
        return _allowed(problem, passed, beyond)
    wider, found = with_stated_values(problem, passed.fit, passed.horizon)
    kept = np.array([p.name not in stated for p in wider.parameters])
    return _allowed(wider, Passed(passed.horizon, found), beyond)[np.ix_(kept, kept)]


def _allowed(problem: Problem, passed: Passed, beyond: float) -> Array:
    """Return the covariance whose 95 % intervals reach as far as the misfit beyond noise allows the truth to lie.

    A displacement d from the minimum raises the misfit by d^T H d, with H the curvature.  A right model at the true values
    leaves noise alone; so a fit with a misfit E beyond noise may be off by any d with d^T H d = E, which is sqrt(E) standard
    deviations in every value.  An error of the model that moves the fit by no more than it leaves unexplained has the same
    effect.  Priors and residuals from before the first touch keep their weight.
    """
    point, machine = passed.fit.point, problem.model.machine
    weights = []
    for drop, r in enumerate(passed.fit.residuals):
        measured, (_, own) = problem.drops[drop], problem.values(point, drop)
        touch = measured.release + own["release"] + _least_fall(machine, own)
        touched = touched_rows(measured, passed.horizon, touch, len(r))
        weights.append(huber(r, 1.0) / np.where(touched, 1 + beyond / Z95**2, 1.0))
    return np.asarray(np.linalg.inv(information(problem, passed.fit, weights)))


def _least_fall(machine: Machine, own: Values) -> float:
    """Return the shortest time, s, in which either end may fall from a drop's levitated position to its ring."""
    deep = [
        bearing.radial_gap.low + own[f"set_point_y_{end}"] for end, bearing in enumerate(machine.touchdown_bearings)
    ]
    return math.sqrt(2 * max(min(deep), 0.0) / machine.gravity)


def _valley(problem: Problem, passed: Passed, beyond: float) -> Array:
    """Return the covariance along the valley in which gap and ball clearance compensate each other.

    The valley is rugged, each local minimum much steeper than the whole, so the local curvature does not show how far along it
    the truth may lie.  Fits begun at neighbouring clearances do: where one ends a distance d away with a misfit larger by D,
    points up to d sqrt(E/D) away are as likely as this one, E being the misfit beyond noise plus what chance may add.
    """
    found, chance = passed.fit, Z95**2
    total = np.zeros((len(found.point), len(found.point)))
    for each in beside(problem, found, passed.horizon):
        more = max(each.misfit - found.misfit, 0.0)
        away = each.point - found.point
        # halved: each clearance has two such fits, one on either side
        total += np.outer(away, away) / 2 / Z95**2 * min(1.0, (beyond + chance) / max(more, chance))
    return total
