"""A problem's minimum to a horizon, how well a point fits, and what is not known of it.

Damped Gauss-Newton steps within bounds (K. Levenberg 1944; D. W. Marquardt, J. SIAM 11 (1963) 431).  Slopes cost a
simulation a parameter, a step only one: so slopes are kept for several steps and corrected by what each step shows
(C. G. Broyden, Math. Comp. 19 (1965) 577), and taken anew where the steps no longer gain.  Differences to one side are wrong
by the curvature, which is great where paths have impacts: where a problem is to be searched to the bottom, a search that no
longer gains by them goes on by the means of both sides, at twice the cost.
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
_ENOUGH = 2e-3  # relative gain of a step, below which slopes are taken anew, or the fit ends
_CHORDS = 2  # steps at most with the same slopes; with more, fits end in wrong minima
_STALE_TRIES, _FRESH_TRIES = 3, 8  # dampings tried with old and with new slopes
_BLOCK_S = 0.01  # s; what is left follows itself in time about as long as a bounce lasts


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a search ended.

    Attributes
    ----------
    point : (n,) array
    residuals, slopes : tuple of array
        Of each drop: (m,), and (m, columns of the drop), the latter near enough for another step.
    misfit : float
        Robust sum of squares in units of the noise, with what is known beforehand, so that fits compare.
    """

    point: Array
    residuals: tuple[Array, ...]
    slopes: tuple[Array, ...]
    misfit: float

    @property
    def count(self) -> int:
        """How many residuals there are."""
        return sum(len(each) for each in self.residuals)

    @property
    def ratio(self) -> float:
        """What is left, a residual: 1 where that is noise alone."""
        return self.misfit / self.count

    @property
    def ratio_of_drops(self) -> Array:
        """The same of each drop, without what is known beforehand."""
        return np.array([squares(each) / len(each) for each in self.residuals])


def fit(
    problem: Problem,
    point: Array,
    horizon: float,
    linearisations: int = _LINEARISATIONS,
    enough: float = _ENOUGH,
    slopes: Sequence[Array] | None = None,
) -> Fit:
    """Return the minimum of a problem to a horizon, from a point.

    Each drop's residuals count in units of their own robust spread, set anew at every step: while the fit is far off,
    a drop that fits worse than the others does not pull them along.

    Parameters
    ----------
    problem : Problem
    point : (n,) array
    horizon : float
        s after the release.
    linearisations : int
        How often slopes may be taken; 0 where `slopes` must do.
    enough : float
        Relative gain of a step, below which slopes are taken anew, or the search ends.
    slopes : sequence of array, optional
        Known from near the point.

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
        if stuck:  # the one side is known from nearby
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
    """Return a point as it stands, with its slopes to some sides (raises InputError where it cannot be simulated)."""
    linear = problem.linearised(point, horizon, sides)
    residuals = tuple(r for r, _ in linear)
    return Fit(point, residuals, tuple(j for _, j in linear), misfit_of(problem, residuals, point))


def as_it_stands(problem: Problem, point: Array, horizon: float, slopes: Sequence[Array]) -> Fit:
    """Return a point as it stands, with slopes known from near it (raises InputError where it cannot be simulated)."""
    residuals = problem.all_residuals(point, horizon)
    if residuals is None:
        raise InputError("the fit left what can be simulated; check gap and probes of the machine file")
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
    """Return point, residuals and slopes after some steps with the same slopes, and the relative gain of all."""
    damping, kept = 1e-3, 1.0
    for _ in range(_CHORDS):
        weights = [huber(r, spread(r)) for r in residuals]
        value = _cost(problem, weights, residuals, point)
        curvature, slope = _normal(problem, weights, residuals, slopes, point)
        for _ in range(tries):
            trial = _step(point, curvature, slope, damping, problem.low, problem.high)
            reached = problem.all_residuals(trial, horizon)
            cost = math.inf if reached is None else _cost(problem, weights, reached, trial)
            if cost < value:
                break
            damping *= 6
        if reached is None or not cost < value:
            break
        slopes = _corrected(problem, slopes, residuals, reached, trial - point)
        point, residuals, kept = trial, reached, kept * cost / value
        damping = max(damping / 5, 1e-7)
        if 1 - cost / value < enough:
            break
    return point, residuals, slopes, 1 - kept


def _cost(problem: Problem, weights: Sequence[Array], residuals: Sequence[Array], point: Array) -> float:
    data = sum(float(w @ r**2) for w, r in zip(weights, residuals, strict=True))
    return data + float(problem.prior @ point**2)


def _normal(
    problem: Problem, weights: Sequence[Array], residuals: Sequence[Array], slopes: Sequence[Array], point: Array
) -> tuple[Array, Array]:
    """Return J^T W J and J^T W r with what is known beforehand."""
    curvature, slope = np.diag(problem.prior), problem.prior * point
    for drop, (r, jacobian) in enumerate(zip(residuals, slopes, strict=True)):
        where = problem.columns(drop)
        weighted = jacobian * weights[drop][:, None]
        curvature[np.ix_(where, where)] += jacobian.T @ weighted
        slope[where] += weighted.T @ r
    return curvature, slope


def _corrected(
    problem: Problem, slopes: Sequence[Array], before: Sequence[Array], after: Sequence[Array], step: Array
) -> list[Array]:
    """Return slopes that explain the last step, and change as little as that takes (Broyden's good update)."""
    out = []
    for drop, (jacobian, r, moved) in enumerate(zip(slopes, before, after, strict=True)):
        along = step[problem.columns(drop)]
        miss = moved - r - jacobian @ along
        out.append(jacobian + np.outer(miss, along / max(float(along @ along), 1e-30)))
    return out


def _step(point: Array, curvature: Array, slope: Array, damping: float, low: Array, high: Array) -> Array:
    """Return the damped step, coordinates that would leave their bounds put there and the others solved again."""
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
    """Return the robust misfit of residuals at a point in fixed units, so that points compare."""
    return sum(squares(r) for r in residuals) + float(problem.prior @ point**2)


def information(problem: Problem, fitted: Fit, weights: Sequence[Array] | None = None) -> Array:
    """Return the Fisher information (n, n) of a fitted point, with what is known beforehand.

    Its inverse is the least covariance that noise leaves to any method (H. Cramer, Mathematical Methods of Statistics, 1946,
    32.3), the growing error of the model counted as noise; `weights` of the residuals, one if not given.
    """
    total = np.diag(np.where(problem.prior > 0, problem.prior, 1e-6))
    for drop, jacobian in enumerate(fitted.slopes):
        where = problem.columns(drop)
        weighted = jacobian if weights is None else jacobian * weights[drop][:, None]
        total[np.ix_(where, where)] += jacobian.T @ weighted
    return total


def covariance_of(problem: Problem, fitted: Fit, horizon: float) -> Array:
    """Return the covariance of a fitted point with what the model does not explain: H^-1 (H + sum g g^T) H^-1.

    H is the curvature, whose inverse holds for residuals that are noise alone; g is the slope of each 10 ms of a drop:
    what is left there follows itself in time and counts as one (P. J. Huber, Proc. 5th Berkeley Symposium 1 (1967) 221;
    K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986) 13).  A few such stretches know little of many values, so H stays in.
    """
    weights = [huber(r, spread(r)) for r in fitted.residuals]
    curvature = information(problem, fitted, weights)
    scatter = np.zeros_like(curvature)
    for drop, (r, jacobian) in enumerate(zip(fitted.residuals, fitted.slopes, strict=True)):
        where = problem.columns(drop)
        measured = problem.drops[drop]
        count = window(measured, horizon)[1]
        block = np.full(len(r), -1)  # pulses and levitated stretch are a block of their own
        times = np.arange(count) * measured.interval // _BLOCK_S
        seen = on_reading_rows(measured, horizon, times)
        block[: len(seen)] = seen
        for each in np.unique(block):
            slope = jacobian[block == each].T @ (weights[drop] * r)[block == each]
            scatter[np.ix_(where, where)] += np.outer(slope, slope)
    inverse = np.linalg.inv(curvature)
    return np.asarray(inverse + inverse @ scatter @ inverse)
