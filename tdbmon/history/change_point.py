"""Change point of a series: the split with the clearest change of level, and its p-value by a permutation test.

The statistic is the greatest absolute two-sample t over all splits (D. M. Hawkins, J. Am. Stat. Assoc. 72 (1977) 180).  The
permutations assume no distribution.  Below six drops no split is significant.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST = 6
SEEN = 0.05  # uncorrected p-value up to which a change point or a trend is shown
_SHUFFLES = 999
_SEED = 20140109  # the same series gives the same answer


@dataclass(frozen=True)
class ChangePoint:
    """A change of level (SI).

    Attributes
    ----------
    index : int
        The first drop after it, from 0.
    before, after : float
        Mean levels.
    p : float
        p-value of the permutation test.
    """

    index: int
    before: float
    after: float
    p: float


def change_point(values: Array) -> ChangePoint | None:
    """Return the change point of values (n,) in order; None below `LEAST` values or if all are equal."""
    n = len(values)
    if n < LEAST or np.ptp(values) == 0:
        return None
    scores = _scores(values[None, :])[0]
    index = int(np.argmax(scores)) + 1
    beyond = int(np.sum(_scores(values[_orders(n)]).max(axis=1) >= scores.max() * (1 - 1e-12)))
    return ChangePoint(
        index, float(values[:index].mean()), float(values[index:].mean()), (beyond + 1) / (_SHUFFLES + 1)
    )


@lru_cache(maxsize=8)
def _orders(n: int) -> NDArray[np.intp]:
    """Return random permutations (k, n), the same for every series of length n."""
    return np.random.default_rng(_SEED).permuted(np.tile(np.arange(n), (_SHUFFLES, 1)), axis=1)


def _scores(series: Array) -> Array:
    """Return |difference of means| sqrt(k (n-k) / n) / total deviation for every split k of each row: grows with |t|."""
    n = series.shape[1]
    centred = series - series.mean(axis=1, keepdims=True)
    k = np.arange(1, n)
    sums = np.cumsum(centred, axis=1)[:, :-1]
    return np.asarray(np.abs(sums) * np.sqrt(n / (k * (n - k))) / np.sqrt(np.sum(centred**2, axis=1, keepdims=True)))
