"""Common slope of all drops of a machine; each combination of speed class and assembly has its own level.

Least squares with Student's t (analysis of covariance: R. A. Fisher, Statistical Methods for Research Workers, 4th ed., 1932).
The levels are fixed effects, not random: two or three do not determine a variance between levels, and an interval based on
one would be too narrow.  At least three drops per level and eight in all are needed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import Estimate
from tdbmon.quantity import counted

Array = NDArray[np.float64]

_LEAST, _AT_LEVEL = 8, 3
ROUNDING = 1e-12  # relative deviation of equal values from their mean by rounding


def common_slope(series: Sequence[Estimate], order: Sequence[int], levels: Sequence[Hashable], unit: str) -> Estimate:
    """Return the slope per drop with its 95 % interval, SI.

    Parameters
    ----------
    series : sequence of Estimate
        The feature in each drop; missing values are left out.
    order : sequence of int
        Number of each drop in the machine's life.
    levels : sequence of hashable
        Level of each drop: its speed class and assembly.
    unit : str
        Of the feature.
    """
    from statsmodels.regression.linear_model import OLS

    rows = at_levels(series, order, levels)
    if rows is None:
        return Estimate.missing(unit, f"needs {_LEAST} drops, at least {_AT_LEVEL} of each speed and assembly")
    found, drops, of_level = rows
    if np.abs(beside_levels(found, of_level)).max() <= ROUNDING * np.abs(found).max():
        return Estimate(0.0, unit=unit, method="all values of a level equal", why="no scatter")
    fitted = OLS(found, np.column_stack([drops, of_level])).fit()
    slope, (low, high) = float(fitted.params[0]), fitted.conf_int()[0].tolist()
    rule = f"least squares, {counted(of_level.shape[1], 'level')} of speed and assembly, per drop"
    return Estimate(slope, low, high, unit, rule)


def at_levels(
    series: Sequence[Estimate], order: Sequence[int], levels: Sequence[Hashable]
) -> tuple[Array, Array, Array] | None:
    """Return values (n,), numbers of their drops (n,) and level indicators (n, k); None if too few."""
    rows = [(e.value, o, c) for e, o, c in zip(series, order, levels, strict=True) if e.value is not None]
    counts = Counter(level for _, _, level in rows)
    rows = [row for row in rows if counts[row[2]] >= _AT_LEVEL]
    if len(rows) < _LEAST:
        return None
    shared = list(dict.fromkeys(level for _, _, level in rows))
    found, drops = (np.array([row[i] for row in rows], float) for i in (0, 1))
    return found, drops, np.array([[each == level for level in shared] for _, _, each in rows], float)


def beside_levels(values: Array, of_level: Array) -> Array:
    """Return values (n,) less the mean of their level, given level indicators (n, k)."""
    return np.asarray(values - of_level @ (values @ of_level / of_level.sum(axis=0)))
