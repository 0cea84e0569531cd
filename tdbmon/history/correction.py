"""Probabilities of many quantities that are looked at together, corrected for their number.

Holm's method bounds the chance of any false flag (S. Holm, Scand. J. Stat. 6 (1979) 65), that of Benjamini and Hochberg the share
of false ones among the flags (J. R. Stat. Soc. B 57 (1995) 289).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

Method = Literal["holm", "fdr_bh"]


def corrected(p: Sequence[float], method: Method) -> list[float]:
    """Return probabilities corrected for how many they are, each at most 1, in the order given."""
    if not p:
        return []
    from statsmodels.stats.multitest import multipletests

    return [float(x) for x in multipletests(p, method=method)[1]]
