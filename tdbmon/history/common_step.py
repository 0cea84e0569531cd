"""Common step of all drops of a machine, at several speeds and assemblies with a level each.

The change point of the values less the mean of their level (`tdbmon.history.change_point`).  The choice between it and a common
slope is by BIC (G. Schwarz, Ann. Stat. 6 (1978) 461): a step has one parameter more, its place.  So sudden wear of a journal is
not reported as a rate, nor gradual wear as a step.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import Estimate
from tdbmon.history.change_point import SEEN, change_point
from tdbmon.history.common_slope import ROUNDING, at_levels, beside_levels

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CommonStep:
    """A step that describes the drops better than a slope.

    Attributes
    ----------
    number : int
        Of the first drop after it.
    size : Estimate
        Rise of the levels, SI.
    p : float
        p-value of the change point.
    """

    number: int
    size: Estimate
    p: float


def common_step(
    series: Sequence[Estimate], order: Sequence[int], levels: Sequence[Hashable], unit: str
) -> CommonStep | None:
    """Return the common step; None if it is not significant or a slope describes the drops better.

    Parameters
    ----------
    series, order, levels, unit
        As of `tdbmon.history.common_slope.common_slope`.
    """
    rows = at_levels(series, order, levels)
    if rows is None:
        return None
    found, drops, of_level = rows
    left = beside_levels(found, of_level)
    point = None if np.abs(left).max() <= ROUNDING * np.abs(found).max() else change_point(left)
    if point is None or point.p > SEEN:
        return None
    size = step_size(left, point.index, drops, of_level)
    if size is None:
        return None
    why = "no interval, since the drop of the step was searched for"
    told = Estimate(size, unit=unit, method="least squares, separate levels", why=why)
    return CommonStep(int(drops[point.index]), told, point.p)


def step_size(left: Array, index: int, drops: Array, of_level: Array) -> float | None:
    """Return the rise of the levels at a step; None if a slope describes the drops better.

    Parameters
    ----------
    left : (n,) array
        Values less the mean of their levels.
    index : int
        Of the first drop after the step.
    drops : (n,) array
        Numbers of the drops.
    of_level : (n, k) array
        Level indicators.
    """
    after = beside_levels((np.arange(len(left)) >= index).astype(float), of_level)
    if not after.any():  # the split coincides with the levels: an overhaul
        return None
    size, step = _fit(left, after)
    _, slope = _fit(left, beside_levels(drops, of_level))
    return None if step * len(left) ** (1 / len(left)) >= slope else size


def _fit(left: Array, course: Array) -> tuple[float, float]:
    """Return the least-squares factor of `course` in `left` (both (n,), less level means) and the residual sum of squares."""
    times = float(course @ left / (course @ course))
    return times, float(np.sum((left - times * course) ** 2))
