"""Probabilities corrected for the number of quantities that are looked at together."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Correction = Literal["holm", "fdr_bh"]


def corrected(p: ArrayLike, correction: Correction) -> NDArray[np.float64]:
    """Return probabilities (n,) such that those at or below a level are the ones to flag at it.

    "holm" bounds the chance of any false flag (S. Holm, Scand. J. Statist. 6 (1979) 65), "fdr_bh" the expected share of false
    flags among the flags (Y. Benjamini, Y. Hochberg, J. R. Statist. Soc. B 57 (1995) 289).
    """
    given = np.asarray(p, float)
    order = np.argsort(given)
    n, rank = len(given), np.arange(len(given))
    if correction == "holm":
        stepped = np.maximum.accumulate((n - rank) * given[order])
    else:
        stepped = np.minimum.accumulate((n / (rank + 1) * given[order])[::-1])[::-1]
    adjusted = np.empty(n)
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted
