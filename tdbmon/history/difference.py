"""One drop's value against those of the drops before: how far off it is, and whether chance makes it so.

The value x of the drop is held against a prediction from n earlier values with the centre m and the scatter s: x - m has
the standard error s sqrt(1 + 1/n) and, over it, Student's t distribution.  Below 15 drops m and s are mean and standard
deviation with n - 1 degrees of freedom; from 15 on Tukey's biweight location and scale, which odd drops among them do not
move, with 0.7 (n - 1) (F. Mosteller, J. W. Tukey, Data Analysis and Regression, 1977).  With fewer drops the biweight's t
is too sure of itself: of normal values, 0.4 % fall below a stated 0.1 % at n = 6, and 0.1 % as stated from 15 on (a test
counts them).  Where x itself is less certain than any of those before, what it is worse by is added.  An error that is a share
of the value grows with it, and is no worse for that.  A scatter below `least` is never believed.

Where the values rise or fall from drop to drop, their scatter about a mean is that change itself.  Each is then carried along
their slope to the drop's place first: s is the scatter about the line, which has a degree of freedom less, and its slope adds
to the error what it is uncertain by.

A drop that was itself off is no measure for those after it: `baseline` goes through the earlier values in their order and
leaves out those that were beyond chance when they came, by the rule that flags a drop.  Without that, a change would hide the
next drop with the same change.

With n = 1 there is no scatter to compare with and no probability is stated; with 2 nothing is called off; with 3 the interval is
so wide that only gross changes stand out: `detectable` says how large a change must be to be flagged at all.
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
LEAST_JUDGED = 3  # drops before, to call one off: with two, the scatter rests on a single difference


@dataclass(frozen=True)
class Before:
    """The drops before, of one feature (SI).

    Attributes
    ----------
    n : int
    median, centre : float
    scatter : float or None
        Standard deviation between drops; None for a single one.
    freedom : float
        Degrees of freedom of the scatter.
    slope : float or None
        A drop, along which they were carried to the place of this one; None where they are taken as they are.
    """

    n: int
    median: float
    centre: float
    scatter: float | None
    freedom: float
    slope: float | None = None


@dataclass(frozen=True)
class Difference:
    """A drop's value less those before (SI).

    Attributes
    ----------
    before : Before
    value : float
        x less the centre.
    low, high : float or None
        95 % interval of it; None where the scatter is not known.
    p : float or None
        Probability of a difference at least as large, of either sign, from a drop like those before.
    error : float or None
        Standard error of the difference; 0 where all values are nought and `least` is a share of them.
    """

    before: Before
    value: float
    low: float | None
    high: float | None
    p: float | None
    error: float | None

    def detectable(self, level: float) -> float | None:
        """Return the smallest difference that has a probability below a level; None where none is called off."""
        from scipy.special import stdtrit

        if not self.error or self.before.n < LEAST_JUDGED:
            return None
        return float(-stdtrit(self.before.freedom, level / 2) * self.error)


def summarise(values: Array, least: float) -> Before:
    """Return centre and scatter of earlier values (n,), n >= 1; a scatter below `least` counts as `least`."""
    n, median = len(values), float(np.median(values))
    if n == 1:
        return Before(1, median, median, None, 0.0)
    if n < _ROBUST_FROM:
        return Before(n, median, float(values.mean()), max(float(values.std(ddof=1)), least), n - 1.0)
    centre, scatter = biweight(values)
    return Before(n, median, centre, max(scatter, least), 0.7 * (n - 1))


def along_slope(values: Array, back: Array, least: float) -> tuple[Before, float]:
    """Return centre and scatter of earlier values (n,), n >= 3, about their line, and the share of its slope in the variance.

    Parameters
    ----------
    values : (n,) array
    back : (n,) array
        How many drops each lies before the one that they are carried to.
    least : float
        Smallest scatter that is believed.

    Returns
    -------
    Before
        At that drop.
    float
        What the slope's own error adds to the variance of the centre there, over that of the scatter (least squares).
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
    """Return the difference of a value from those before.

    Parameters
    ----------
    value, sigma : float
        Of the drop, with its own standard error (0 where not known).
    values, sigmas : (n,) arrays
        Of the drops before.
    least : float
        Smallest scatter that is believed.
    relative : bool
        Errors are shares of the value, where those before are plainly not nought.
    back : (n,) array, optional
        How many drops each lies before this one; with it they are held against it along their slope.
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
    """Return which of the values (n, k) of k quantities, drop by drop in order, are a measure for what comes after.

    A value is left out by the rule of a flag: its probability by the values kept so far, three at least, is corrected for how
    many quantities the drop has.  With a stricter one a drop that was flagged would stay a measure, and hide the next like it.

    Parameters
    ----------
    values : (n, k) array
        NaN where a drop lacks a quantity.
    least : (k,) array
        Smallest scatter that is believed.
    level : float
        Corrected probability up to which a value is left out.
    correction : str
        How the probabilities of a drop are corrected together.
    """
    kept = np.ones(values.shape, dtype=bool)
    # of those kept so far (B. P. Welford, Technometrics 4 (1962) 419)
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
    """Return the probabilities of differences at least as large by chance; 1 or 0 where there is no error at all."""
    from scipy.special import stdtr

    sure = error == 0
    p = 2 * stdtr(freedom, -np.abs(difference) / np.where(sure, 1.0, error))
    return np.asarray(np.where(sure, difference == 0, p))


def biweight(values: Array) -> tuple[float, float]:
    """Return Tukey's biweight location and scale of values (n,).

    Where at least half of them are equal the biweight has no scale: then median and standard deviation, which the odd ones
    among them widen, so that the next odd one is not flagged for being unequal.

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
