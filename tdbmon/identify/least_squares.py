"""A problem's minimum to a horizon, how well a point fits, and what is not known of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.levenberg import minimise
from tdbmon.identify.prediction import window
from tdbmon.identify.problem import Problem, huber, spread

Array = NDArray[np.float64]

STEPS = 10  # linearisations at most
ENOUGH = 1e-3  # relative gain that ends it
_BLOCK_S = 0.01  # s; what is left follows itself in time about as long as a bounce lasts


def fit(problem: Problem, point: Array, horizon: float, steps: int = STEPS, enough: float = ENOUGH) -> Array:
    """Return the minimum of a problem to a horizon, from a point.

    Each drop's residuals count in units of their own robust spread, set anew at every step: while the fit is far off,
    a drop that fits worse than the others does not pull them along.

    Raises
    ------
    InputError
        If the point cannot be simulated.
    """
    weights: list[Array] = []

    def cost(at: Array) -> float:
        residuals = problem.all_residuals(at, horizon)
        return math.inf if residuals is None else total(residuals, at)

    def total(residuals: Sequence[Array], at: Array) -> float:
        data = sum(float(w @ r**2) for w, r in zip(weights, residuals, strict=True))
        return 0.5 * (data + float(problem.prior @ at**2))

    def linearise(at: Array) -> tuple[float, Array, Array]:
        found = problem.linearised(at, horizon)
        weights[:] = [huber(r, spread(r)) for r, _ in found]
        curvature, slope = np.diag(problem.prior), problem.prior * at
        for drop, (r, jacobian) in enumerate(found):
            where = problem.columns(drop)
            weighted = jacobian * weights[drop][:, None]
            curvature[np.ix_(where, where)] += jacobian.T @ weighted
            slope[where] += weighted.T @ r
        return total([r for r, _ in found], at), curvature, slope

    return minimise(cost, linearise, point, problem.low, problem.high, steps, enough).point


def misfit(problem: Problem, point: Array, horizon: float) -> float:
    """Return the robust misfit of a point in fixed units, so that points compare."""
    residuals = problem.all_residuals(point, horizon)
    if residuals is None:
        return math.inf
    return sum(float(huber(r, 1.0) @ r**2) for r in residuals) + float(problem.prior @ point**2)


def covariance_of(problem: Problem, point: Array, horizon: float) -> Array:
    """Return the covariance of the point with what the model does not explain: H^-1 (H + sum g g^T) H^-1.

    H is the curvature, whose inverse holds for residuals that are noise alone; g is the slope of each 10 ms of a drop:
    what is left there follows itself in time and counts as one (P. J. Huber, Proc. 5th Berkeley Symposium 1 (1967) 221;
    K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13).  A few such stretches know little of many values, so H stays in.
    """
    curvature = np.diag(np.where(problem.prior > 0, problem.prior, 1e-6))
    scatter = np.zeros_like(curvature)
    for drop, (r, jacobian) in enumerate(problem.linearised(point, horizon)):
        where = problem.columns(drop)
        weights = huber(r, spread(r))
        curvature[np.ix_(where, where)] += jacobian.T @ (jacobian * weights[:, None])
        measured = problem.drops[drop]
        count = window(measured, horizon)[1]
        block = np.full(len(r), -1)  # pulses and levitated stretch are a block of their own
        times = np.arange(count) * measured.interval // _BLOCK_S
        block[: len(measured.probes) * count] = np.tile(times, len(measured.probes))
        for each in np.unique(block):
            slope = jacobian[block == each].T @ (weights * r)[block == each]
            scatter[np.ix_(where, where)] += np.outer(slope, slope)
    inverse = np.linalg.inv(curvature)
    return inverse + inverse @ scatter @ inverse
