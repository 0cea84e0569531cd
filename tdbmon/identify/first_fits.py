"""The plain model fitted to the first contacts of two drops: by these fits it is judged whether the machine file is right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from tdbmon.identify.least_squares import Fit, fit_or_none
from tdbmon.identify.problem import Problem
from tdbmon.identify.stages import Stages

STAGES = Stages()  # those of a usual gap: the gap that the file states may be what is wrong
SLOPES = 4  # of each fit
_DROPS = 2  # that are looked at


def few_drops(problem: Problem) -> Problem:
    """Return a problem of the first two drops."""
    return replace(problem, drops=problem.drops[:_DROPS], own=problem.own[:_DROPS])


def of_which(problem: Problem) -> str:
    """Say of which drops that is, behind what is told of them; "" where these are all."""
    if len(problem.drops) <= _DROPS:
        return ""
    return f" of {' and '.join(drop.name for drop in problem.drops[:_DROPS])}"


def first_fits(few: Problem) -> Mapping[float, Fit]:
    """Return fits from the nominal values on to the fall and the first contacts, by their horizons in s.

    None beyond where the model cannot be simulated.
    """
    fits: dict[float, Fit] = {}
    point = few.start
    for horizon in (STAGES.fall, *STAGES.first_contacts):
        found = fit_or_none(few, point, horizon, SLOPES)
        if found is None:
            break
        fits[horizon], point = found, found.point
    return fits
