"""How residuals count: those far beyond their spread linearly, not by their square (P. J. Huber, Ann. Math. Statist. 35
(1964) 73), so that a few odd samples do not lead a fit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.prediction import DECELERATION

Array = NDArray[np.float64]

FLOOR = 0.9  # squares a residual that noise alone leaves, at most: large ones count less than their square
_FROM = 3.0  # times the spread: from there on linearly


def spread(residual: Array) -> float:
    """Return how many times wider than expected the residuals are, robustly; at least 1."""
    return max(1.0, 1.4826 * float(np.median(np.abs(residual))))


def huber(residual: Array, scale: float) -> Array:
    """Return the weights of a drop's residuals: 1/scale^2, less for those beyond three times it.

    The one that the deceleration before the release leaves is no sample among many: it counts by its square always.
    """
    away = np.abs(residual) / scale
    away[DECELERATION] = 0.0
    return np.minimum(1.0, _FROM / np.maximum(away, 1e-12)) / scale**2


def squares(r: Array) -> float:
    """Return the sum of squares of residuals in units of the noise, large ones counting less: what a fit leaves."""
    return float(huber(r, 1.0) @ r**2)
