"""The course of a feature over the drops: slope and whether it has one (rank tests), and where it changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import Estimate
from tdbmon.history.change_point import SEEN, ChangePoint, change_point
from tdbmon.history.common_step import step_size

_LEAST = 4  # drops: with three, six orders are possible and none is unlikely
_LEAST_INTERVAL = 5  # of four, the least and the greatest slope hold 92 %


@dataclass(frozen=True)
class Trend:
    """Course of a feature over drops in their order (SI).

    Attributes
    ----------
    slope : Estimate
        A drop; Theil and Sen's median of all slopes between pairs, with its 95 % interval.
    p : float
        Probability of as many pairs in one order by chance (Kendall's test against the order of the drops).
    change : ChangePoint or None
        Where the level changed, if anywhere; None below six drops.
    step : ChangePoint or None
        The same where chance seldom parts the drops so and a slope describes them no better: then there is no rate a drop.
    first : float
        Level at the first drop, where the slope begins.
    grown : float or None
        From the first drop to the last along the slope, over that level, or by the step over the one before it; None where
        that is not above zero.
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
        Those that are known.
    numbers : sequence of int
        Number of each drop: those that lack the feature count, or a slope a drop would be too steep.

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
        flat = Estimate(0.0, unit=unit, method="all drops alike", why="no scatter")
        return Trend(flat, 1.0, None, None, float(values[0]), 0.0)
    found = theilslopes(values, order, alpha=0.95)
    rule = "median of the slopes between pairs of drops (Theil, Sen), a drop"
    if len(values) >= _LEAST_INTERVAL:
        slope = Estimate(float(found.slope), float(found.low_slope), float(found.high_slope), unit, rule)
    else:
        slope = Estimate(float(found.slope), unit=unit, method=rule, why="four drops bear no 95 % interval")
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
    """Return the probability of as many pairs of values (n,) in one order by chance; 1 below four values or where all are equal.

    Source: M. G. Kendall, Biometrika 30 (1938) 81 (exact for few drops without ties).
    """
    if len(values) < _LEAST or np.ptp(values) == 0:
        return 1.0
    from scipy.stats import kendalltau

    p = float(kendalltau(np.arange(len(values)), values).pvalue)
    return p if np.isfinite(p) else 1.0
