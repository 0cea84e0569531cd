"""Correction of p-values for multiple testing.

Holm's method bounds the probability of any false alarm (S. Holm, Scand. J. Stat. 6 (1979) 65), that of Benjamini and Hochberg
the false discovery rate (J. R. Stat. Soc. B 57 (1995) 289).  statsmodels has both too, but its function runs a full garbage
collection at every call: 0.2 s with records in memory, and the history of a machine needs a hundred calls.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

Method = Literal["holm", "fdr_bh"]


def corrected(p: Sequence[float], method: Method) -> list[float]:
    """Return p-values corrected for their number, each at most 1, in the given order."""
    rising = np.argsort(p)
    each, number = np.array(p, dtype=float)[rising], len(p)
    if method == "holm":
        each = np.maximum.accumulate(each * np.arange(number, 0, -1))
    else:
        each = np.minimum.accumulate((each / (np.arange(1, number + 1) / max(1, number)))[::-1])[::-1]
    found = np.empty(number)
    found[rising] = np.minimum(each, 1.0)
    return found.tolist()
