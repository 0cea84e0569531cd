"""Drops that cannot be of one machine in one condition: told before anything is made of all of them.

What a model lacks acts in every drop.  So each drop is fitted by itself, its values free within the tolerances of the machine
file, to the fall and the first contact: where some leave far more than the others, no cause that is sought in all of them
explains that, however long one seeks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tdbmon.identify.first_fits import SLOPES
from tdbmon.identify.least_squares import fit_or_none
from tdbmon.identify.one_drop import only
from tdbmon.identify.prediction import DECELERATION
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import FLOOR, huber

# times what others leave: drops of other machines left 6 to 450 times as much, those with an effect in common 2.9 at most
_FAR_MORE = 10.0


def mixed_drops(problem: Problem) -> str | None:
    """Say which drops, each by itself, leave far more than the others up to the first contact; None where they go together."""
    count = len(problem.drops)
    if count < 2:
        return None
    left = problem.crew.apart(_left, [(only(problem, [drop]),) for drop in range(count)])
    for k, instant in enumerate((problem.stages.fall, problem.stages.met)):
        at = [of_drop[k] for of_drop in left]
        odd = _far_more(at)
        if odd:
            return _said(problem, at, odd, instant)
    return None


def _left(alone: Problem) -> tuple[float, float]:
    """Return what the model leaves of the readings of one drop in the fall, and up to the first contact, a residual.

    How the rotor slows is left out: windage that the file does not know shows in the fastest drop alone.
    """
    point, out = alone.start, [math.inf, math.inf]
    for k, horizon in enumerate((alone.stages.fall, alone.stages.met)):
        found = fit_or_none(alone, point, horizon, SLOPES)
        if found is None:
            break
        point, (residual,) = found.point, found.residuals
        counted = np.delete(huber(residual, 1.0) * residual**2, DECELERATION)
        out[k] = float(np.mean(counted))
    return out[0], out[1]


def _far_more(left: Sequence[float]) -> list[int]:
    """Return which drops leave far more than all others; none where they go together."""
    order = sorted(range(len(left)), key=lambda drop: left[drop])
    for k in range(1, len(order)):
        if left[order[k]] > _FAR_MORE * max(left[order[k - 1]], FLOOR):
            return sorted(order[k:])
    return []


def _said(problem: Problem, left: Sequence[float], odd: Sequence[int], instant: float) -> str:
    others = [drop for drop in range(len(left)) if drop not in odd]
    least, most = min(left[drop] for drop in odd), max(left[drop] for drop in others)
    beyond = f"{least:.3g} times what noise would" if math.isfinite(least) else "more than can be told"
    many = len(odd) > 1
    return (
        f"{_names(problem, odd)} {'do' if many else 'does'} not go with {_names(problem, others)}: each fitted by itself, the"
        f" plain model leaves {beyond} in the first {instant * 1e3:g} ms of the former{' at least' if many else ''}, and"
        f" {most:.2g} times of the latter{' at most' if len(others) > 1 else ''}: they are of another machine, or it or its"
        " cables changed between the drops"
    )


def _names(problem: Problem, drops: Sequence[int]) -> str:
    return ", ".join(problem.drops[drop].name for drop in drops)
