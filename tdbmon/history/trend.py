"""Trend of a feature over the drops: slope and its significance (rank tests), and change point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import Estimate
from tdbmon.history.change_point import SEEN, ChangePoint, change_point
from tdbmon.history.common_step import step_size

_LEAST = 4  # drops: with three, only six orders are possible and none is significant
_LEAST_INTERVAL = 5  # drops: with four, even the extreme slopes give an interval of only 92 %


@dataclass(frozen=True)
class Trend:
    """Trend of a feature over drops in order (SI).

    Attributes
    ----------
    slope : Estimate
        Per drop; Theil-Sen median of all pairwise slopes, with its 95 % interval.
    p : float
        p-value of Kendall's test for a trend over the order of the drops.
    change : ChangePoint or None
        Change point, if any; None below six drops.
    step : ChangePoint or None
        The same if it is significant and a slope describes the drops no better: then there is no rate per drop.
    first : float
        Level of the trend line at the first drop.
    grown : float or None
        Relative growth from the first drop to the last along the slope, or by the step; None if the level before is not
        positive.
    """

    slope: Estimate
    p: float
    change: ChangePoint | None
    step: ChangePoint | None
    first: float
    grown: float | None


def trend_of(series: Sequence[Estimate], numbers: Sequence[int]) -> Trend | None:
    """Return the trend of a feature over drops in order; None below four.

    Parameters
    ----------
    series : sequence of Estimate
        Known values.
    numbers : sequence of int
        Number of each drop, counting those that lack the feature, since the slope per drop would else be too steep.

    Notes
    -----
    Source of the slope: P. K. Sen, J. Am. Stat. Assoc. 63 (1968) 1379.
    """
    values = np.array([e.value for e in series], float)
    if len(values) < _LEAST:
        return None
    from scipy.stats import theilslopes

    order: NDArray[np.float64] = np.array(numbers, float)
    unit = series[0].unit
    if np.ptp(values) == 0:
        flat = Estimate(0.0, unit=unit, method="all values equal", why="no scatter")
        return Trend(flat, 1.0, None, None, float(values[0]), 0.0)
    found = theilslopes(values, order, alpha=0.95)
    rule = "median of the slopes between pairs of drops (Theil, Sen), per drop"
    if len(values) >= _LEAST_INTERVAL:
        slope = Estimate(float(found.slope), float(found.low_slope), float(found.high_slope), unit, rule)
    else:
        slope = Estimate(float(found.slope), unit=unit, method=rule, why="four drops give no 95 % interval")
    change = change_point(values)
    step = change if change is not None and change.p <= SEEN and _stepped(values, change, order) else None
    first = float(found.intercept + found.slope * order[0])
    level, more = first, float(found.slope * (order[-1] - order[0]))
    if step is not None:
        level, more = step.before, step.after - step.before
    return Trend(slope, order_p(values), change, step, first, more / level if level > 0 else None)


def _stepped(values: NDArray[np.float64], change: ChangePoint, order: NDArray[np.float64]) -> bool:
    return step_size(values - values.mean(), change.index, order, np.ones((len(values), 1))) is not None


def order_p(values: NDArray[np.float64]) -> float:
    """Return the p-value of Kendall's test for a trend in values (n,); 1 below four values or if all are equal.

    Source: M. G. Kendall, Biometrika 30 (1938) 81 (exact for few drops without ties).
    """
    if len(values) < _LEAST or np.ptp(values) == 0:
        return 1.0
    from scipy.stats import kendalltau

    p = float(kendalltau(np.arange(len(values)), values).pvalue)
    return p if np.isfinite(p) else 1.0
