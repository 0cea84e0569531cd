"""Damped Gauss-Newton within bounds, on normal equations: K. Levenberg 1944, D. W. Marquardt, J. SIAM 11 (1963) 431."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_GIVE_UP = 1e8  # damping at which no step helps any more


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where the search ended.

    Attributes
    ----------
    point : (n,) array
    cost : float
        Half the sum of squares there.
    curvature : (n, n) array
        J^T J there.
    at_bound : (n,) array of bool
        Which coordinates a bound holds.
    steps : int
        Accepted.
    """

    point: Array
    cost: float
    curvature: Array
    at_bound: NDArray[np.bool_]
    steps: int


def minimise(
    cost: Callable[[Array], float],
    linearise: Callable[[Array], tuple[float, Array, Array]],
    start: Array,
    low: Array,
    high: Array,
    steps: int,
    enough: float = 1e-3,
) -> Minimum:
    """Minimise half a sum of squares within bounds.

    Parameters
    ----------
    cost : callable
        Half the sum of squares at a point, with the weights of the last linearisation; infinite where it is impossible.
    linearise : callable
        Half the sum of squares at a point, J^T J (n, n) and J^T r (n,) with weights set anew there.
    start, low, high : (n,) arrays
        Coordinates of like size.
    steps : int
        Linearisations at most.
    enough : float
        Relative gain of a step below which it ends.
    """
    point = np.clip(start, low, high)
    damping, taken = 1e-3, 0
    value, curvature, slope = linearise(point)
    for _ in range(steps):
        moved = False
        while damping < _GIVE_UP:
            trial = _step(point, curvature, slope, damping, low, high)
            reached = cost(trial)
            if reached < value:
                moved = True
                break
            damping *= 6
        if not moved:
            break
        gain = (value - reached) / value
        point, taken = trial, taken + 1
        damping = max(damping / 5, 1e-7)
        value, curvature, slope = linearise(point)
        if gain < enough:
            break
    held = ((point <= low) & (slope > 0)) | ((point >= high) & (slope < 0))
    return Minimum(point, value, curvature, held, taken)


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
