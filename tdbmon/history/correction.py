"""Probabilities of many quantities that are looked at together, corrected for their number.

Holm's method bounds the chance of any false flag (S. Holm, Scand. J. Stat. 6 (1979) 65), that of Benjamini and Hochberg the share
of false ones among the flags (J. R. Stat. Soc. B 57 (1995) 289).  Both are in statsmodels too, whose function collects all
garbage at every call: 0.2 s with records in memory, and the history of a machine corrects a hundred times.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

Method = Literal["holm", "fdr_bh"]


def corrected(p: Sequence[float], method: Method) -> list[float]:
    """Return probabilities corrected for how many they are, each at most 1, in the order given."""
    rising = np.argsort(p)
    each, number = np.array(p, dtype=float)[rising], len(p)
    if method == "holm":
        each = np.maximum.accumulate(each * np.arange(number, 0, -1))
    else:
        each = np.minimum.accumulate((each / (np.arange(1, number + 1) / max(1, number)))[::-1])[::-1]
    found = np.empty(number)
    found[rising] = np.minimum(each, 1.0)
    return found.tolist()
