"""Covariance of a fit with noise in its Jacobian.

The Jacobian is computed by differences of simulations, which are not smooth where a contact begins or ends.  In the curvature
J^T W J its errors count as information, most of all for collinear parameters: two unbalances in one plane, of which only the sum
is determined, seem to be distinguished.  In the product of Jacobians computed with different steps the errors mostly cancel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.least_squares import Fit, linearised
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber, spread

Array = NDArray[np.float64]

_FINER = 0.2  # times the usual difference steps


def agreed_covariance(problem: Problem, fitted: Fit, horizon: float) -> Array:
    """Return the covariance (n, n) of a fitted point from the product of its Jacobian and one with finer steps.

    Parameters
    ----------
    problem : Problem
    fitted : Fit
        With its Jacobian by the usual steps.
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
    return np.asarray(np.linalg.inv(_positive_part(curvature) + known))


def _with_steps(problem: Problem, share: float) -> Problem:
    """Return a problem with difference steps multiplied by a factor."""
    return replace(
        problem,
        shared=tuple(replace(p, nudge=share * p.nudge) for p in problem.shared),
        own=tuple(tuple(replace(p, nudge=share * p.nudge) for p in own) for own in problem.own),
    )


def _positive_part(curvature: Array) -> Array:
    """Return a symmetric matrix, scaled to a unit diagonal, with its negative eigenvalues, which are noise, set to zero."""
    size = np.sqrt(np.maximum(np.diag(curvature), 1e-9))
    values, vectors = np.linalg.eigh(curvature / np.outer(size, size))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(size, size))
