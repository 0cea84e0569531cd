"""What a fit knows where its slopes are rough.

Slopes are differences of simulations, and these are not smooth where a contact begins or ends.  In the curvature J^T W J the
errors of the slopes count as knowledge, most where two values do the same: an unbalance and another in the same plane, told in
sum only, seem to be told apart.  In the product of slopes that were taken by different steps the errors mostly cancel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.least_squares import Fit, linearised
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber, spread

Array = NDArray[np.float64]

_FINER = 0.2  # times the usual steps


def agreed_covariance(problem: Problem, fitted: Fit, horizon: float) -> Array:
    """Return the covariance (n, n) of a fitted point by the curvature that slopes with usual and with finer steps agree on.

    Parameters
    ----------
    problem : Problem
    fitted : Fit
        With slopes by the usual steps.
    horizon : float
        s after the release.

    Raises
    ------
    InputError
        If the point cannot be simulated.
    """
    finer = linearised(_with_steps(problem, _FINER), fitted.point, horizon)
    curvature = np.zeros((len(fitted.point), len(fitted.point)))
    for drop, (r, usual, fine) in enumerate(zip(fitted.residuals, fitted.slopes, finer.slopes, strict=True)):
        where = problem.columns(drop)
        product = usual.T @ (fine * huber(r, spread(r))[:, None])
        curvature[np.ix_(where, where)] += (product + product.T) / 2
    known = np.diag(np.where(problem.prior > 0, problem.prior, 1e-6))
    return np.asarray(np.linalg.inv(_without_negative(curvature) + known))


def _with_steps(problem: Problem, share: float) -> Problem:
    """Return a problem whose slopes are taken by other steps."""
    return replace(
        problem,
        shared=tuple(replace(p, nudge=share * p.nudge) for p in problem.shared),
        own=tuple(tuple(replace(p, nudge=share * p.nudge) for p in own) for own in problem.own),
    )


def _without_negative(curvature: Array) -> Array:
    """Return a symmetric matrix without its negative part, values scaled alike: directions on which nothing agrees."""
    size = np.sqrt(np.maximum(np.diag(curvature), 1e-9))
    values, vectors = np.linalg.eigh(curvature / np.outer(size, size))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(size, size))
