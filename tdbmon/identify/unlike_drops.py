"""Inconsistent drops: one that fits far worse than the others, or two sets that see a bearing at different places.

A fit to several drops has one gap and one centre per bearing, and per drop a zero of each probe, which hardly drifts.  Where a
bearing was changed, reseated or worn between the drops, the zeros have to compensate; where they cannot, the robust fit follows
the majority.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tdbmon.identify.least_squares import Fit
from tdbmon.identify.parameters import ZERO_SIGMA
from tdbmon.identify.problem import Problem

_FAR_WORSE = 4.0  # times the median misfit ratio of the other drops
_APART = 3.0  # standard deviations of the zeros' drift: least step between drops that is reported


def unlike_drops(problem: Problem, fit: Fit) -> list[str]:
    """Return remarks on inconsistent drops; none where all are consistent.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        Preferably to the first contacts: later the path of a single drop may diverge.
    """
    return [*_far_worse(problem, fit)] or [*_seen_elsewhere(problem, fit)]


def _far_worse(problem: Problem, fit: Fit) -> list[str]:
    """Return remarks on drops that fit far worse than the others."""
    ratios = fit.ratio_of_drops
    out = []
    for i, drop in enumerate(problem.drops):
        others = np.delete(ratios, i)
        if others.size >= 2 and ratios[i] > _FAR_WORSE * max(float(np.median(others)), 1.0):
            out.append(
                f"{drop.name}: fits {ratios[i] / np.median(others):.1f} times worse than the other drops: it is of another"
                " machine, or the machine has changed between the drops; evaluate it alone"
            )
    return out


def _seen_elsewhere(problem: Problem, fit: Fit) -> list[str]:
    """Return a remark on two sets of drops in which a probe sees its bearing at different places."""
    probes = dict.fromkeys(probe.name for drop in problem.drops for probe in drop.probes)
    own = [problem.values(fit.point, drop)[1] for drop in range(len(problem.drops))]
    found = []
    for probe in probes:
        seen = [
            (values[f"zero_{probe}"], k)
            for k, values in enumerate(own)
            if any(each.name == probe for each in problem.drops[k].probes)
        ]
        found.append((*_widest(sorted(seen)), probe))
    apart, lower, upper, probe = max(found, default=(0.0, (), (), ""))
    if apart < _APART * ZERO_SIGMA:
        return []
    high, low = (", ".join(problem.drops[k].name for k in sorted(each)) for each in (upper, lower))
    return [
        f"{high} hardly {'matches' if len(upper) == 1 else 'match'} {low}: fitted with one gap and one centre of each bearing,"
        f" the zero of probe '{probe}' is at least {apart * 1e6:.2g} um higher in the former, while such zeros drift by"
        f" {ZERO_SIGMA * 1e6:.2g} um. If the probe was not touched, a bearing was changed, reseated or worn between the drops,"
        " they are of different machines, or the model lacks what differs from drop to drop, such as an odd ball"
    ]


def _widest(ordered: list[tuple[float, int]]) -> tuple[float, tuple[int, ...], tuple[int, ...]]:
    """Return the widest step between sorted values, and the drops below and above it."""
    steps = [(high[0] - low[0], k + 1) for k, (low, high) in enumerate(pairwise(ordered))]
    step, at = max(steps, default=(0.0, 0))
    return step, tuple(k for _, k in ordered[:at]), tuple(k for _, k in ordered[at:])
