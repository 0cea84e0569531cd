"""Least-squares fit of a problem to a horizon, its misfit, and the covariance of the fitted point.

Damped Gauss-Newton steps within bounds (K. Levenberg 1944; D. W. Marquardt, J. SIAM 11 (1963) 431).  A Jacobian costs one
simulation per parameter, a step only one.  So the Jacobian is kept for several steps with rank-one updates (C. G. Broyden,
Math. Comp. 19 (1965) 577), and computed anew where the steps no longer gain.  One-sided differences have an error in
proportion to the curvature, which is large where paths have impacts: with `Problem.to_the_bottom`, a search that no longer gains
by them continues with central differences, at twice the cost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.prediction import on_reading_rows, window
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import huber, spread, squares

Array = NDArray[np.float64]

_LINEARISATIONS = 8  # at most
_ENOUGH = 2e-3  # relative gain of a step, below which the Jacobian is computed anew, or the fit ends
_CHORDS = 2  # steps at most per Jacobian; with more, fits end in wrong minima
_STALE_TRIES, _FRESH_TRIES = 3, 8  # dampings tried with an old and with a new Jacobian
_BLOCK_S = 0.01  # s; residuals are correlated in time over about the length of a bounce


@dataclass(frozen=True, eq=False)
class Fit:
    """A point with its residuals, Jacobian and misfit: the end of a search.

    Attributes
    ----------
    point : (n,) array
    residuals, slopes : tuple of array
        Per drop: (m,), and the Jacobian (m, columns of the drop), good enough for another step.
    misfit : float
        Robust sum of squares in units of the noise plus that of the prior, comparable between fits.
    """

    point: Array
    residuals: tuple[Array, ...]
    slopes: tuple[Array, ...]
    misfit: float

    @property
    def count(self) -> int:
        """Number of residuals."""
        return sum(len(each) for each in self.residuals)

    @property
    def ratio(self) -> float:
        """Misfit ratio, the misfit per residual: 1 for noise alone."""
        return self.misfit / self.count

    @property
    def ratio_of_drops(self) -> Array:
        """Misfit ratio of each drop, without the prior."""
        return np.array([squares(each) / len(each) for each in self.residuals])


def fit(
    problem: Problem,
    point: Array,
    horizon: float,
    linearisations: int = _LINEARISATIONS,
    enough: float = _ENOUGH,
    slopes: Sequence[Array] | None = None,
) -> Fit:
    """Return the local minimum of a problem to a horizon, starting from a point.

    Each drop's residuals are scaled by their own robust spread, updated at every step: while the fit is far off, a drop that
    fits worse than the others does not dominate them.

    Parameters
    ----------
    problem : Problem
    point : (n,) array
    horizon : float
        s after the release.
    linearisations : int
        Greatest number of Jacobians computed; 0 to use `slopes` only.
    enough : float
        Relative gain of a step, below which the Jacobian is computed anew, or the search ends.
    slopes : sequence of array, optional
        Jacobian of each drop, known from near the point.

    Raises
    ------
    InputError
        If the point cannot be simulated.
    """
    point = np.clip(point, problem.low, problem.high)
    known = slopes is not None
    start = as_it_stands(problem, point, horizon, slopes) if slopes is not None else linearised(problem, point, horizon)
    residuals, current = list(start.residuals), list(start.slopes)
    linearisations -= 0 if known else 1
    sides: tuple[int, ...] = (1,)
    while True:
        tries = _STALE_TRIES if known else _FRESH_TRIES
        point, residuals, current, gained = _chords(problem, point, residuals, current, horizon, enough, tries)
        stuck = not known and gained < enough
        if linearisations <= 0 or (stuck and not (problem.to_the_bottom and sides == (1,))):
            return Fit(point, tuple(residuals), tuple(current), misfit_of(problem, residuals, point))
        linearisations -= 1
        if stuck:  # the forward differences are known from nearby
            sides = (1, -1)
            other = linearised(problem, point, horizon, (-1,))
            current = [(a + b) / 2 for a, b in zip(current, other.slopes, strict=True)]
            continue
        fresh = linearised(problem, point, horizon, sides)
        residuals, current, known = list(fresh.residuals), list(fresh.slopes), False


def fit_or_none(problem: Problem, point: Array, horizon: float, linearisations: int = _LINEARISATIONS) -> Fit | None:
    """Return `fit`; None where the point cannot be simulated."""
    try:
        return fit(problem, point, horizon, linearisations)
    except InputError:
        return None


def linearised(problem: Problem, point: Array, horizon: float, sides: Sequence[int] = (1,)) -> Fit:
    """Return a point with residuals and Jacobian, by differences to some sides (raises InputError if not simulable)."""
    linear = problem.linearised(point, horizon, sides)
    residuals = tuple(r for r, _ in linear)
    return Fit(point, residuals, tuple(j for _, j in linear), misfit_of(problem, residuals, point))


def as_it_stands(problem: Problem, point: Array, horizon: float, slopes: Sequence[Array]) -> Fit:
    """Return a point with residuals, and a Jacobian known from near it (raises InputError if not simulable)."""
    residuals = problem.all_residuals(point, horizon)
    if residuals is None:
        raise InputError("the fit left the range that can be simulated; check gap and probes of the machine file")
    return Fit(point, tuple(residuals), tuple(slopes), misfit_of(problem, residuals, point))


def _chords(
    problem: Problem,
    point: Array,
    residuals: list[Array],
    slopes: list[Array],
    horizon: float,
    enough: float,
    tries: int,
) -> tuple[Array, list[Array], list[Array], float]:
    """Return point, residuals and updated Jacobian after some steps from one Jacobian, and their total relative gain."""
    damping, kept = 1e-3, 1.0
    for _ in range(_CHORDS):
        weights = [huber(r, spread(r)) for r in residuals]
        value = _cost(problem, weights, residuals, point)
        curvature, slope = _normal_equations(problem, weights, residuals, slopes, point)
        for _ in range(tries):
            trial = _step(point, curvature, slope, damping, problem.low, problem.high)
            reached = problem.all_residuals(trial, horizon)
            cost = math.inf if reached is None else _cost(problem, weights, reached, trial)
            if cost < value:
                break
            damping *= 6
        if reached is None or not cost < value:
            break
        slopes = _broyden_update(problem, slopes, residuals, reached, trial - point)
        point, residuals, kept = trial, reached, kept * cost / value
        damping = max(damping / 5, 1e-7)
        if 1 - cost / value < enough:
            break
    return point, residuals, slopes, 1 - kept


def _cost(problem: Problem, weights: Sequence[Array], residuals: Sequence[Array], point: Array) -> float:
    data = sum(float(w @ r**2) for w, r in zip(weights, residuals, strict=True))
    return data + float(problem.prior @ point**2)


def _normal_equations(
    problem: Problem, weights: Sequence[Array], residuals: Sequence[Array], slopes: Sequence[Array], point: Array
) -> tuple[Array, Array]:
    """Return J^T W J and J^T W r, the prior included."""
    curvature, slope = np.diag(problem.prior), problem.prior * point
    for drop, (r, jacobian) in enumerate(zip(residuals, slopes, strict=True)):
        where = problem.columns(drop)
        weighted = jacobian * weights[drop][:, None]
        curvature[np.ix_(where, where)] += jacobian.T @ weighted
        slope[where] += weighted.T @ r
    return curvature, slope


def _broyden_update(
    problem: Problem, slopes: Sequence[Array], before: Sequence[Array], after: Sequence[Array], step: Array
) -> list[Array]:
    """Return the Jacobian with the least change that reproduces the last step (Broyden's good update)."""
    out = []
    for drop, (jacobian, r, moved) in enumerate(zip(slopes, before, after, strict=True)):
        along = step[problem.columns(drop)]
        miss = moved - r - jacobian @ along
        out.append(jacobian + np.outer(miss, along / max(float(along @ along), 1e-30)))
    return out


def _step(point: Array, curvature: Array, slope: Array, damping: float, low: Array, high: Array) -> Array:
    """Return the point after a damped step; coordinates that would leave their bounds are clipped and the rest solved again."""
    free = np.ones(len(point), dtype=bool)
    change = np.zeros(len(point))
    for _ in range(len(point)):
        matrix = curvature[np.ix_(free, free)]
        scale = np.diag(curvature)[free] + 1e-6 * np.mean(np.diag(curvature))
        right = -(slope + curvature @ np.where(free, 0.0, change))[free]
        change[free] = np.linalg.solve(matrix + damping * np.diag(scale), right)
        trial = point + change
        out = free & ((trial < low) | (trial > high))
        if not out.any():
            break
        change[out] = np.clip(trial[out], low[out], high[out]) - point[out]
        free &= ~out
        if not free.any():
            break
    return np.clip(point + change, low, high)


def misfit_of(problem: Problem, residuals: Sequence[Array], point: Array) -> float:
    """Return the robust misfit at a point in units of the noise, comparable between points."""
    return sum(squares(r) for r in residuals) + float(problem.prior @ point**2)


def information(problem: Problem, fitted: Fit, weights: Sequence[Array] | None = None) -> Array:
    """Return the Fisher information (n, n) of a fitted point, the prior included.

    Its inverse is the Cramer-Rao bound on the covariance (H. Cramer, Mathematical Methods of Statistics, 1946, 32.3), with the
    growing error of the model counted as noise.  `weights` of the residuals are one by default.
    """
    total = np.diag(np.where(problem.prior > 0, problem.prior, 1e-6))
    for drop, jacobian in enumerate(fitted.slopes):
        where = problem.columns(drop)
        weighted = jacobian if weights is None else jacobian * weights[drop][:, None]
        total[np.ix_(where, where)] += jacobian.T @ weighted
    return total


def covariance_of(problem: Problem, fitted: Fit, horizon: float) -> Array:
    """Return the covariance of a fitted point, robust to correlated residuals: H^-1 (H + sum g g^T) H^-1.

    H is the curvature, whose inverse is the covariance where residuals are noise alone; g is the gradient of each block of 10 ms
    of a drop, within which residuals are correlated (sandwich estimator of clusters: P. J. Huber, Proc. 5th Berkeley Symposium 1
    (1967) 221; K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13).  A few blocks do not span many parameters, so H is added.
    """
    weights = [huber(r, spread(r)) for r in fitted.residuals]
    curvature = information(problem, fitted, weights)
    scatter = np.zeros_like(curvature)
    for drop, (r, jacobian) in enumerate(zip(fitted.residuals, fitted.slopes, strict=True)):
        where = problem.columns(drop)
        measured = problem.drops[drop]
        count = window(measured, horizon)[1]
        block = np.full(len(r), -1)  # pulses and levitated stretch form one block
        times = np.arange(count) * measured.interval // _BLOCK_S
        seen = on_reading_rows(measured, horizon, times)
        block[: len(seen)] = seen
        for each in np.unique(block):
            slope = jacobian[block == each].T @ (weights[drop] * r)[block == each]
            scatter[np.ix_(where, where)] += np.outer(slope, slope)
    inverse = np.linalg.inv(curvature)
    return np.asarray(inverse + inverse @ scatter @ inverse)
