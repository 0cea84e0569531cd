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

from tdbmon.identify.follow import Passed
from tdbmon.identify.least_squares import Fit
from tdbmon.identify.own_paths import BEYOND
from tdbmon.identify.prediction import noise_alone
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber

Array = NDArray[np.float64]

_SETTLED_S = 0.018  # s after the release; fits to longer horizons are compared
_Z = 1.96  # standard deviations of a 95 % interval


def drift(passed: Sequence[Passed]) -> Array:
    """Return the mean square of how far the fits to shorter horizons lie from the last, as a covariance (n, n).

    Were the model right, they would differ by their noise; what the model lacks pulls them apart.
    """
    *earlier, last = passed
    points = [each.fit.point for each in earlier if each.horizon > _SETTLED_S]
    total = np.zeros((len(last.fit.point), len(last.fit.point)))
    for each in points:
        total += np.outer(each - last.fit.point, each - last.fit.point) / len(points)
    return total


def reach(problem: Problem, passed: Sequence[Passed]) -> Array:
    """Return the covariance (n, n) of the last fit: of the last that left noise alone, and how fits drift apart.

    Contacts that a fit does not explain prove nothing of its values; these rest on the contacts before.
    """
    beyond = [_beyond(problem, each) for each in passed]
    lost = next((k for k, (more, usual) in enumerate(beyond) if more > usual), len(passed))
    last = max(lost - 1, 0)
    return drift(passed) + _allowed(problem, passed[last].fit, beyond[last][0])


def _beyond(problem: Problem, passed: Passed) -> tuple[float, float]:
    """Return what a fit leaves beyond noise, and how much that may be by chance (chi-squared, two standard deviations)."""
    noise = [noise_alone(drop, passed.horizon) for drop in problem.drops]
    left = [float(huber(r, 1.0) @ r**2) for r in passed.fit.residuals]
    return sum(max(0.0, a - b) for a, b in zip(left, noise, strict=True)), BEYOND * math.sqrt(2 * sum(noise))


def _allowed(problem: Problem, fitted: Fit, beyond: float) -> Array:
    """Return the covariance whose 95 % intervals reach to where what a fit leaves beyond noise lets the truth lie.

    A point off by d leaves d^T H d more, H the curvature.  At the truth a right model leaves noise; so where a fit leaves
    E more than noise it may be off by any d with d^T H d = E, which is sqrt(E) standard deviations in every value.  An
    error of the model that moves the fit by no more than what it leaves unexplained does the same.  What is known
    beforehand stays as sure as it is.
    """
    curvature = np.zeros((len(fitted.point), len(fitted.point)))
    for drop, (r, jacobian) in enumerate(zip(fitted.residuals, fitted.slopes, strict=True)):
        where = problem.columns(drop)
        curvature[np.ix_(where, where)] += jacobian.T @ (jacobian * huber(r, 1.0)[:, None])
    known = np.diag(np.where(problem.prior > 0, problem.prior, 1e-6))
    return np.asarray(np.linalg.inv(curvature / (1 + beyond / _Z**2) + known))
