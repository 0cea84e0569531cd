"""Drops that hardly go together: their readings against the bearings differ by more than probes' zeros drift.

A fit to several drops has one gap and one centre a bearing, and a zero of each probe in each drop, which hardly drifts.
Where a bearing was changed, seated anew or worn between the drops, the zeros have to make up for it.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.parameters import ZERO_SIGMA
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_APART = 3.5  # standard deviations of such a drift, of the step between drops that is told


def unlike_drops(problem: Problem, point: Array) -> str | None:
    """Say which drops hardly go with the others by the zeros of a fit; None where all do.

    Parameters
    ----------
    problem : Problem
    point : (n,) array
        Where the fit ended.
    """
    probes = dict.fromkeys(probe.name for drop in problem.drops for probe in drop.probes)
    own = [problem.values(point, drop)[1] for drop in range(len(problem.drops))]
    found = []
    for probe in probes:
        seen = [(values[f"zero_{probe}"], k) for k, values in enumerate(own) if f"zero_{probe}" in values]
        found.append((*_widest(sorted(seen)), probe))
    apart, lower, upper, probe = max(found, default=(0.0, (), (), ""))
    if apart < _APART * ZERO_SIGMA:
        return None
    high, low = (", ".join(problem.drops[k].name for k in sorted(each)) for each in (upper, lower))
    return (
        f"{high} hardly {'goes' if len(upper) == 1 else 'go'} with {low}: fitted with one gap and one centre of each bearing,"
        f" probe '{probe}' has a zero {apart * 1e6:.2g} um higher in the former at least, where such zeros drift by"
        f" {ZERO_SIGMA * 1e6:.2g} um. If the probe was not touched, a bearing was changed, seated anew or worn between the drops,"
        " they are of different machines, or the model lacks what each drop meets otherwise, as an odd ball"
    )


def _widest(ordered: list[tuple[float, int]]) -> tuple[float, tuple[int, ...], tuple[int, ...]]:
    """Return the widest step between values in order, and which drops are below and above it."""
    steps = [(high[0] - low[0], k + 1) for k, (low, high) in enumerate(pairwise(ordered))]
    step, at = max(steps, default=(0.0, 0))
    return step, tuple(k for _, k in ordered[:at]), tuple(k for _, k in ordered[at:])
