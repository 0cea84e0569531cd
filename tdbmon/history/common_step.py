"""Where all drops of a machine changed their level at once, over drops of several speeds and assemblies.

The change point of what is left of the values beside the mean of each level (`tdbmon.history.change_point`).  Between it and
one slope decides the criterion of G. Schwarz, Ann. Stat. 6 (1978) 461: a step has a parameter more than a slope, its place.
So a journal that was worn at once is no rate of wear, and one that wears from drop to drop is no step.
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
    """A step that describes the drops better than a slope does.

    Attributes
    ----------
    number : int
        Of the first drop after it.
    size : Estimate
        By which the levels rise there, SI.
    p : float
        Probability of a split as clear by chance.
    """

    number: int
    size: Estimate
    p: float


def common_step(
    series: Sequence[Estimate], order: Sequence[int], levels: Sequence[Hashable], unit: str
) -> CommonStep | None:
    """Return the step of all drops; None where chance makes one as clear, or a slope describes the drops better.

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
    told = Estimate(size, unit=unit, method="least squares, levels apart", why="its place was sought: no interval")
    return CommonStep(int(drops[point.index]), told, point.p)


def step_size(left: Array, index: int, drops: Array, of_level: Array) -> float | None:
    """Return by how much the levels rise at a step; None where a slope describes the drops better.

    Parameters
    ----------
    left : (n,) array
        Values less the mean of their levels.
    index : int
        Of the first drop after the step.
    drops : (n,) array
        Numbers of the drops.
    of_level : (n, k) array
        Whether each is at each level.
    """
    after = beside_levels((np.arange(len(left)) >= index).astype(float), of_level)
    if not after.any():  # it parts the levels themselves: an overhaul
        return None
    size, step = _fit(left, after)
    _, slope = _fit(left, beside_levels(drops, of_level))
    return None if step * len(left) ** (1 / len(left)) >= slope else size


def _fit(left: Array, course: Array) -> tuple[float, float]:
    """Return how many times values have a course, both (n,) beside the means of their levels, and the squares that are left."""
    times = float(course @ left / (course @ course))
    return times, float(np.sum((left - times * course) ** 2))
