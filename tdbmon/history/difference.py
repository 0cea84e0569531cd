"""One drop's value against its baseline of earlier drops: the difference and its significance.

The value x is compared with the prediction from n earlier values of centre m and scatter s: x - m has the standard error
s sqrt(1 + 1/n), and their ratio Student's t distribution.  Below 15 drops m and s are mean and standard deviation, with n - 1
degrees of freedom; from 15 on Tukey's biweight location and scale, which outliers do not move, with 0.7 (n - 1)
(F. Mosteller, J. W. Tukey, Data Analysis and Regression, 1977).  With fewer drops the biweight's t is anticonservative: the
false-alarm rate for normal values at a nominal 0.1 % is 0.4 % at n = 6, and 0.1 % from 15 on (verified by a test).  If the
variance of x itself exceeds the largest among the earlier values, the excess is added; relative errors are first scaled to the
larger value.  The scatter is at least `least`.

If the values have a trend, their scatter about a mean is mostly that trend.  Each is then first extrapolated along the slope to
this drop: s is the scatter about the line, with one degree of freedom less, and the uncertainty of the slope is added to the
error.

Outliers are excluded from the baseline: `baseline` goes through the earlier values in order and leaves out those that were
significant when they came, by the rule that flags a drop.  Otherwise a change would hide the next drop with the same change.

With n = 1 there is no scatter and no p-value; with 2 nothing is flagged; with 3 the prediction interval is so wide that only
gross changes stand out: `detectable` gives the smallest change that would be flagged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import Z95
from tdbmon.history.correction import Method, corrected

Array = NDArray[np.float64]

_ROBUST_FROM = 15
_TUNING = 9.0  # of the biweight's scale, in units of the median absolute deviation; 6 for its location
_LOCATION = 6.0
_TAIL = 0.975
LEAST_JUDGED = 3  # earlier drops needed to flag one: with two, the scatter rests on a single difference


@dataclass(frozen=True)
class Before:
    """Baseline of one feature (SI).

    Attributes
    ----------
    n : int
    median, centre : float
    scatter : float or None
        Standard deviation between drops; None for a single drop.
    freedom : float
        Degrees of freedom of the scatter.
    slope : float or None
        Per drop, along which the values were extrapolated to this drop; None if they were not.
    """

    n: int
    median: float
    centre: float
    scatter: float | None
    freedom: float
    slope: float | None = None


@dataclass(frozen=True)
class Difference:
    """A drop's value less the centre of its baseline (SI).

    Attributes
    ----------
    before : Before
    value : float
        x less the centre.
    low, high : float or None
        95 % interval of the difference; None if the scatter is unknown.
    p : float or None
        Two-sided p-value of the difference.
    error : float or None
        Standard error of the difference; 0 if all values are zero and `least` is relative to them.
    """

    before: Before
    value: float
    low: float | None
    high: float | None
    p: float | None
    error: float | None

    def detectable(self, level: float) -> float | None:
        """Return the smallest difference significant at a level; None if none is flagged."""
        from scipy.special import stdtrit

        if not self.error or self.before.n < LEAST_JUDGED:
            return None
        return float(-stdtrit(self.before.freedom, level / 2) * self.error)


def summarise(values: Array, least: float) -> Before:
    """Return centre and scatter, at least `least`, of earlier values (n,), n >= 1."""
    n, median = len(values), float(np.median(values))
    if n == 1:
        return Before(1, median, median, None, 0.0)
    if n < _ROBUST_FROM:
        return Before(n, median, float(values.mean()), max(float(values.std(ddof=1)), least), n - 1.0)
    centre, scatter = biweight(values)
    return Before(n, median, centre, max(scatter, least), 0.7 * (n - 1))


def along_slope(values: Array, back: Array, least: float) -> tuple[Before, float]:
    """Return centre and scatter of earlier values (n,), n >= 3, about their trend line, and the variance added by its slope.

    Parameters
    ----------
    values : (n,) array
    back : (n,) array
        Number of drops from each to the drop that they are extrapolated to.
    least : float
        Lower bound of the scatter.

    Returns
    -------
    Before
        At that drop.
    float
        Variance of the centre there due to the slope, over the variance of the scatter (as for least squares).
    """
    from scipy.stats import theilslopes

    slope = float(theilslopes(values, -back).slope)
    level = summarise(values + slope * back, 0.0)
    n, scatter = len(values), level.scatter or 0.0
    freedom = level.freedom - 1
    about = replace(level, scatter=max(scatter * math.sqrt((n - 1) / (n - 2)), least), freedom=freedom, slope=slope)
    return about, float(back.mean() ** 2 / np.sum((back - back.mean()) ** 2))


def compare_value(
    value: float,
    sigma: float,
    values: Array,
    sigmas: Array,
    least: float,
    *,
    relative: bool = False,
    back: Array | None = None,
) -> Difference:
    """Return the difference of a value from its baseline.

    Parameters
    ----------
    value, sigma : float
        Of the drop, with its own standard error (0 if unknown).
    values, sigmas : (n,) arrays
        Of the baseline.
    least : float
        Lower bound of the scatter.
    relative : bool
        Standard errors scale with the value, if the baseline is significantly different from zero.
    back : (n,) array, optional
        Number of drops from each to this one; if given, they are extrapolated along their slope.
    """
    from scipy.special import stdtrit

    before, tilt = (summarise(values, least), 0.0) if back is None else along_slope(values, back, least)
    difference = value - before.centre
    if before.scatter is None:
        return Difference(before, difference, None, None, None, None)
    usual = float(np.max(sigmas))
    if relative and Z95 * usual < abs(before.centre):
        usual *= max(1.0, abs(value / before.centre))
    worse = max(0.0, sigma**2 - usual**2)
    error = float(np.sqrt(before.scatter**2 * (1 + 1 / before.n + tilt) + worse))
    p = float(_probability(*np.array([difference, error, before.freedom])))
    half = float(stdtrit(before.freedom, _TAIL)) * error
    return Difference(before, difference, difference - half, difference + half, p, error)


def baseline(values: Array, least: Array, level: float, correction: Method = "holm") -> NDArray[np.bool_]:
    """Return the baseline of k features as a mask over their values (n, k) in drop order, True where kept.

    A value is excluded by the rule that flags a drop: its p-value against the values kept so far, at least three, corrected for
    the number of features in the drop.  With a stricter rule a flagged drop would stay in the baseline and hide the next like it.

    Parameters
    ----------
    values : (n, k) array
        NaN where a drop lacks a feature.
    least : (k,) array
        Lower bounds of the scatter.
    level : float
        Corrected p-value up to which a value is excluded.
    correction : str
        Method of correction for multiple testing within a drop.
    """
    kept = np.ones(values.shape, dtype=bool)
    # running statistics of the values kept so far (B. P. Welford, Technometrics 4 (1962) 419)
    n, mean, squares = np.zeros(len(least), int), np.zeros(len(least)), np.zeros(len(least))
    for row, keep in zip(values, kept, strict=True):
        known = np.isfinite(row)
        (tested,) = np.nonzero(known & (n > 1))
        if len(tested):
            m = n[tested]
            scatter = np.maximum(np.sqrt(squares[tested] / (m - 1)), least[tested])
            p = _probability(row[tested] - mean[tested], scatter * np.sqrt(1 + 1 / m), m - 1.0)
            keep[tested] = (np.array(corrected(p.tolist(), correction)) > level) | (m < LEAST_JUDGED)
        taken = known & keep
        n += taken
        step = np.where(taken, row - mean, 0.0)
        mean += step / np.maximum(n, 1)
        squares += np.where(taken, step * (row - mean), 0.0)
    return kept


def _probability(difference: Array, error: Array, freedom: Array) -> Array:
    """Return two-sided p-values of differences; 1 or 0 where the standard error is 0."""
    from scipy.special import stdtr

    sure = error == 0
    p = 2 * stdtr(freedom, -np.abs(difference) / np.where(sure, 1.0, error))
    return np.asarray(np.where(sure, difference == 0, p))


def biweight(values: Array) -> tuple[float, float]:
    """Return Tukey's biweight location and scale of values (n,).

    If at least half of them are equal the biweight has no scale: then median and standard deviation, which outliers among them
    widen, so that the next one is not flagged merely for being unequal.

    Source: D. C. Hoaglin, F. Mosteller, J. W. Tukey, Understanding Robust and Exploratory Data Analysis (1983),
    sections 11 and 12.
    """
    median = float(np.median(values))
    deviation = float(np.median(np.abs(values - median)))
    if deviation == 0:
        return median, float(values.std(ddof=1)) if np.ptp(values) else 0.0
    u = (values - median) / (_LOCATION * deviation)
    weight = np.where(np.abs(u) < 1, (1 - u**2) ** 2, 0.0)
    location = float(np.sum(weight * values) / np.sum(weight))
    u2 = ((values - median) / (_TUNING * deviation)) ** 2
    near = u2 < 1
    above = float(np.sum((values[near] - median) ** 2 * (1 - u2[near]) ** 4))
    below = float(np.sum((1 - u2[near]) * (1 - 5 * u2[near])))
    n = len(values)
    return location, float(np.sqrt(n * above) / abs(below))
