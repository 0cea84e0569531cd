"""One slope for all drops of a machine, over drops of several speeds and assemblies: each of these has a level of its own.

Least squares, drop by drop, with Student's t (analysis of covariance: R. A. Fisher, Statistical Methods for Research Workers,
4th ed., 1932).  The levels are free, not random: two or three of them tell no variance between levels, and an interval that
is made from one would be too narrow.  It needs three drops at a level and eight in all.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence

import numpy as np
from scipy.special import stdtrit

from tdbmon.estimate import Estimate

_LEAST, _AT_LEVEL = 8, 3
_TAIL = 0.975
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
    rows = [(e.value, o, c) for e, o, c in zip(series, order, levels, strict=True) if e.value is not None]
    counts = Counter(level for _, _, level in rows)
    rows = [row for row in rows if counts[row[2]] >= _AT_LEVEL]
    shared = list(dict.fromkeys(level for _, _, level in rows))
    if len(rows) < _LEAST:
        return Estimate.missing(unit, f"needs {_LEAST} drops, {_AT_LEVEL} at least of each speed and assembly")
    number = np.array([shared.index(level) for _, _, level in rows])
    found, drops = (np.array([row[i] for row in rows], float) for i in (0, 1))
    values, at = _from_level(found, number), _from_level(drops, number)
    if np.abs(values).max() <= _ROUNDING * np.abs(found).max():
        return Estimate(0.0, unit=unit, method="all drops of a level alike", why="no scatter")
    slope = float(at @ values / (at @ at))
    freedom = len(rows) - len(shared) - 1
    error = float(np.sqrt(np.sum((values - slope * at) ** 2) / freedom / (at @ at)))
    half = float(stdtrit(freedom, _TAIL)) * error
    rule = f"least squares, {len(shared)} level{'' if len(shared) == 1 else 's'} of speed and assembly, a drop"
    return Estimate(slope, slope - half, slope + half, unit, rule)


def _from_level(values: np.ndarray, number: np.ndarray) -> np.ndarray:
    """Return values (n,) less the mean of their level."""
    means = np.bincount(number, values) / np.bincount(number)
    return np.asarray(values - means[number])
