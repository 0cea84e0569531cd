"""Drops that cannot be of one machine in one condition, detected before any fit to all of them.

A cause acts in every drop.  So each drop is fitted by itself within the tolerances of the machine file, up to the first contacts:
where the misfit ratios of some far exceed those of the others, no cause common to all drops can explain it.
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

# times the misfit ratios of the others: drops of two machines or states differ by 6 to 450, with a common effect by up to 3.3
_FAR_MORE = 10.0


def mixed_drops(problem: Problem) -> str | None:
    """Say which drops, each fitted by itself, have far greater misfit ratios up to the first contacts; None if no drop has."""
    count = len(problem.drops)
    if count < 2:
        return None
    left = problem.crew.apart(_left, [(only(problem, [drop]),) for drop in range(count)])
    for k, instant in enumerate(_instants(problem)):
        at = [of_drop[k] for of_drop in left]
        odd = _far_more(at)
        if odd:
            return _said(problem, at, odd, instant)
    return None


def _instants(problem: Problem) -> tuple[float, ...]:
    """Return the horizons of these fits: the fall, the contact of one end, and of both."""
    return problem.stages.fall, problem.stages.met, problem.stages.touched


def _left(alone: Problem) -> list[float]:
    """Return the misfit ratios of the readings of a drop fitted by itself, horizon by horizon.

    The deceleration before the release is left out: an unknown windage shows in the fastest drop alone.
    """
    point, out = alone.start, [math.inf] * len(_instants(alone))
    for k, horizon in enumerate(_instants(alone)):
        found = fit_or_none(alone, point, horizon, SLOPES)
        if found is None:
            break
        point, (residual,) = found.point, found.residuals
        counted = np.delete(huber(residual, 1.0) * residual**2, DECELERATION)
        out[k] = float(np.mean(counted))
    return out


def _far_more(left: Sequence[float]) -> list[int]:
    """Return the drops whose misfit ratios exceed those of all others by far; none where they go together."""
    order = sorted(range(len(left)), key=lambda drop: left[drop])
    for k in range(1, len(order)):
        if left[order[k]] > _FAR_MORE * max(left[order[k - 1]], FLOOR):
            return sorted(order[k:])
    return []


def _said(problem: Problem, left: Sequence[float], odd: Sequence[int], instant: float) -> str:
    others = [drop for drop in range(len(left)) if drop not in odd]
    least, most = min(left[drop] for drop in odd), max(left[drop] for drop in others)
    verb, bound = ("do", "at least ") if len(odd) > 1 else ("does", "")
    beyond = f"{bound}{least:.3g} times that of noise alone" if math.isfinite(least) else "too large to be computed"
    return (
        f"{_names(problem, odd)} {verb} not match {_names(problem, others)}: each fitted alone, the misfit of the plain model is"
        f" {beyond} in the first {instant * 1e3:g} ms of the former, and {'at most ' if len(others) > 1 else ''}{most:.2g} times"
        " in the latter: they are of another machine, or the machine or its cables changed between the drops"
    )


def _names(problem: Problem, drops: Sequence[int]) -> str:
    return ", ".join(problem.drops[drop].name for drop in drops)
