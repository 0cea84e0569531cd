"""How far the truth may lie from a fitted point, in view of what the fit leaves.

Were the model right and the least misfit found, noise alone would be left, and the fit's curvature would say it all.
Misfits of paths with impacts are rugged: fits end in hollows, each steep in itself.  And no model is quite right.  What
is left beyond noise tells of both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.follow import Passed
from tdbmon.identify.prediction import noise_alone
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber

Array = NDArray[np.float64]

_Z = 1.96  # standard deviations of a 95 % interval


def drift(passed: Sequence[Passed]) -> Array:
    """Return the mean square of how far the fits to shorter horizons lie from the last, as a covariance (n, n).

    Were the model right, they would differ by their noise; what the model lacks pulls them apart.
    """
    *earlier, last = (each.fit.point for each in passed)
    total = np.zeros((len(last), len(last)))
    for each in earlier:
        total += np.outer(each - last, each - last) / len(earlier)
    return total


def reach(problem: Problem, passed: Sequence[Passed]) -> Array:
    """Return the covariance (n, n) of the last fit by all fits on the way: the mean of theirs, and how they drift apart.

    A later fit is no surer witness than an earlier one that it followed into its hollow, so none counts more.
    """
    return drift(passed) + sum(_allowed(problem, each) for each in passed) / len(passed)


def _allowed(problem: Problem, passed: Passed) -> Array:
    """Return the covariance whose 95 % intervals reach to where what a fit leaves beyond noise lets the truth lie.

    A point off by d leaves d^T H d more, H the curvature.  At the truth a right model leaves noise; so where a fit leaves
    E more than noise it may be off by any d with d^T H d = E, which is sqrt(E) standard deviations in every value.  An
    error of the model that moves the fit by no more than what it leaves unexplained does the same.  What is known
    beforehand stays as sure as it is.
    """
    curvature, beyond = np.zeros((len(passed.fit.point), len(passed.fit.point))), 0.0
    for drop, (r, jacobian) in enumerate(zip(passed.fit.residuals, passed.fit.slopes, strict=True)):
        where, weights = problem.columns(drop), huber(r, 1.0)
        curvature[np.ix_(where, where)] += jacobian.T @ (jacobian * weights[:, None])
        beyond += max(0.0, float(weights @ r**2) - noise_alone(problem.drops[drop], passed.horizon))
    known = np.diag(np.where(problem.prior > 0, problem.prior, 1e-6))
    return np.asarray(np.linalg.inv(curvature / (1 + beyond / _Z**2) + known))
