"""Probabilities of many quantities that are looked at together, corrected for their number.

Holm's method bounds the chance of any false flag (S. Holm, Scand. J. Stat. 6 (1979) 65), that of Benjamini and Hochberg the share
of false ones among the flags (J. R. Stat. Soc. B 57 (1995) 289).  They are written out here, since `multipletests` of statsmodels
makes Python collect its garbage at every call, which took most of the time of a comparison.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

Method = Literal["holm", "fdr_bh"]


def corrected(p: Sequence[float], method: Method) -> list[float]:
    """Return probabilities corrected for how many they are, each at most 1, in the order given."""
    if not p:
        return []
    values = np.array(p, float)
    order = np.argsort(values)
    rank = np.arange(1, len(values) + 1)
    if method == "holm":
        rising = np.maximum.accumulate(values[order] * (len(values) + 1 - rank))
    else:
        rising = np.minimum.accumulate((values[order] * len(values) / rank)[::-1])[::-1]
    found = np.empty(len(values))
    found[order] = np.minimum(rising, 1.0)
    return [float(x) for x in found]
