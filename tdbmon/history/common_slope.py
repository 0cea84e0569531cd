"""One slope for all drops of a machine, over drops of several speeds and assemblies: each of these has a level of its own.

Least squares, drop by drop, with Student's t (analysis of covariance: R. A. Fisher, Statistical Methods for Research Workers,
4th ed., 1932).  The levels are free, not random: two or three of them tell no variance between levels, and an interval that
is made from one would be too narrow.  It needs three drops at a level and eight in all.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence

import numpy as np

from tdbmon.estimate import Estimate
from tdbmon.quantity import counted

_LEAST, _AT_LEVEL = 8, 3
_ROUNDING = 1e-12  # relative: what equal values may be off their mean


def common_slope(series: Sequence[Estimate], order: Sequence[int], levels: Sequence[Hashable], unit: str) -> Estimate:
    """Return the slope a drop with its 95 % interval, SI.

    Parameters
    ----------
    series : sequence of Estimate
        The feature, drop by drop; the missing ones are left out.
    order : sequence of int
        Number of each drop in the machine's life.
    levels : sequence of hashable
        What drops of the same level share: class of speed and assembly.
    unit : str
        Of the feature.
    """
    from statsmodels.regression.linear_model import OLS

    rows = [(e.value, o, c) for e, o, c in zip(series, order, levels, strict=True) if e.value is not None]
    counts = Counter(level for _, _, level in rows)
    rows = [row for row in rows if counts[row[2]] >= _AT_LEVEL]
    shared = list(dict.fromkeys(level for _, _, level in rows))
    if len(rows) < _LEAST:
        return Estimate.missing(unit, f"needs {_LEAST} drops, {_AT_LEVEL} at least of each speed and assembly")
    found, drops = (np.array([row[i] for row in rows], float) for i in (0, 1))
    of_level = np.array([[each == level for level in shared] for _, _, each in rows], float)
    means = found @ of_level / of_level.sum(axis=0)
    if np.abs(found - of_level @ means).max() <= _ROUNDING * np.abs(found).max():
        return Estimate(0.0, unit=unit, method="all drops of a level alike", why="no scatter")
    fitted = OLS(found, np.column_stack([drops, of_level])).fit()
    slope, (low, high) = float(fitted.params[0]), fitted.conf_int()[0].tolist()
    rule = f"least squares, {counted(len(shared), 'level')} of speed and assembly, a drop"
    return Estimate(slope, low, high, unit, rule)
