"""Robust weights of residuals: linear instead of quadratic loss far beyond their spread (P. J. Huber, Ann. Math. Statist. 35
(1964) 73), so that a few outliers do not dominate a fit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.prediction import DECELERATION

Array = NDArray[np.float64]

FLOOR = 0.9  # misfit ratio of noise alone, at most: below 1, as large residuals count less than their square
_FROM = 3.0  # times the spread, from which on the loss is linear


def spread(residual: Array) -> float:
    """Return a robust standard deviation of residuals (from the median absolute value), at least 1."""
    return max(1.0, 1.4826 * float(np.median(np.abs(residual))))


def huber(residual: Array, scale: float) -> Array:
    """Return the weights of a drop's residuals: 1/scale^2, less for those beyond three times the scale.

    The single residual of the deceleration before the release always has full weight.
    """
    away = np.abs(residual) / scale
    away[DECELERATION] = 0.0
    return np.minimum(1.0, _FROM / np.maximum(away, 1e-12)) / scale**2


def squares(r: Array) -> float:
    """Return the robust sum of squares of residuals in units of the noise: their part of the misfit."""
    return float(huber(r, 1.0) @ r**2)
