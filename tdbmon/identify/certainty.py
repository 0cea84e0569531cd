"""How far the truth may lie from a fitted point, in view of what the fit leaves.

Were the model right and the least misfit found, noise alone would be left, and the fit's curvature would say it all.
Misfits of paths with impacts are rugged: fits end in hollows, each steep in itself.  And no model is quite right.  What
is left beyond noise tells of both.
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
    """Return the mean square of how far the fits to shorter horizons lie from the last, as a covariance (n, n).

    Were the model right, they would differ by their noise; what the model lacks pulls them apart.
    """
    *earlier, last = passed
    points = [each.fit.point for each in earlier if each.horizon > settled]
    total = np.zeros((len(last.fit.point), len(last.fit.point)))
    for each in points:
        total += np.outer(each - last.fit.point, each - last.fit.point) / len(points)
    return total


def reach(problem: Problem, passed: Sequence[Passed]) -> Array:
    """Return the covariance (n, n) of the last fit, whose 95 % intervals reach as far as the truth may lie.

    Contacts that a fit does not explain prove nothing of its values; these rest on the contacts before, and so on the
    last fit that left noise alone.
    """
    beyond = [_beyond(problem, each) for each in passed]
    lost = next((k for k, (more, usual) in enumerate(beyond) if more > usual), len(passed))
    rest, (more, _) = passed[max(lost - 1, 0)], beyond[max(lost - 1, 0)]
    return drift(passed, problem.stages.sound) + _with_stated_values(problem, rest, more) + _valley(problem, rest, more)


def _beyond(problem: Problem, passed: Passed) -> tuple[float, float]:
    """Return what a fit leaves beyond noise, and how much that may be by chance (chi-squared, two standard deviations)."""
    noise = [noise_alone(drop, passed.horizon) for drop in problem.drops]
    left = [squares(r) for r in passed.fit.residuals]
    return sum(max(0.0, a - b) for a, b in zip(left, noise, strict=True)), BEYOND * math.sqrt(2 * sum(noise))


def _with_stated_values(problem: Problem, passed: Passed, beyond: float) -> Array:
    """Return `_allowed` as it is where nobody knows exactly what the machine file states without tolerance.

    A fit that takes it as stated makes up for its errors with the values that it may move.
    """
    stated = {p.name for p in stated_parameters(problem.model.machine)}
    if not stated.isdisjoint(p.name for p in problem.shared):
        return _allowed(problem, passed, beyond)
    wider, found = with_stated_values(problem, passed.fit, passed.horizon)
    kept = np.array([p.name not in stated for p in wider.parameters])
    return _allowed(wider, Passed(passed.horizon, found), beyond)[np.ix_(kept, kept)]


def _allowed(problem: Problem, passed: Passed, beyond: float) -> Array:
    """Return the covariance whose 95 % intervals reach to where what a fit leaves beyond noise lets the truth lie.

    A point off by d leaves d^T H d more, H the curvature.  At the truth a right model leaves noise; so where a fit leaves
    E more than noise it may be off by any d with d^T H d = E, which is sqrt(E) standard deviations in every value.  An
    error of the model that moves the fit by no more than what it leaves unexplained does the same.  What is known
    beforehand stays as sure as it is, and so does what was measured before anything touched.
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
    """Return the time, s, in which the shaft may fall to a ring from where a drop's own values hold it, at either end."""
    deep = [
        bearing.radial_gap.low + own[f"set_point_y_{end}"] for end, bearing in enumerate(machine.touchdown_bearings)
    ]
    return math.sqrt(2 * max(min(deep), 0.0) / machine.gravity)


def _valley(problem: Problem, passed: Passed, beyond: float) -> Array:
    """Return the covariance of what a fit does not tell along the valley of gap and clearance of the balls.

    It is rugged, each hollow much steeper than the whole, so that curvature says nothing of how far the truth is along
    it.  Fits begun beside the clearances do: one that ends further off by d and leaves D more makes points up to
    d sqrt(E/D) as likely as this one, E what it leaves beyond noise and what chance may add.
    """
    found, chance = passed.fit, Z95**2
    total = np.zeros((len(found.point), len(found.point)))
    for each in beside(problem, found, passed.horizon):
        more = max(each.misfit - found.misfit, 0.0)
        away = each.point - found.point
        # two a clearance, on either side of it
        total += np.outer(away, away) / 2 / Z95**2 * min(1.0, (beyond + chance) / max(more, chance))
    return total
