"""The plain model fitted to the first contacts of two drops: the fits by which the machine file is checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from tdbmon.identify.least_squares import Fit, fit_or_none
from tdbmon.identify.problem import Problem
from tdbmon.identify.stages import Stages

STAGES = Stages()  # those of a usual gap, since the gap in the file may be wrong
SLOPES = 4  # Jacobians per fit
_DROPS = 2  # drops used


def few_drops(problem: Problem) -> Problem:
    """Return a problem of the first two drops."""
    return replace(problem, drops=problem.drops[:_DROPS], own=problem.own[:_DROPS])


def of_which(problem: Problem) -> str:
    """Return the names of these drops as a suffix for messages; "" where the problem has no others."""
    if len(problem.drops) <= _DROPS:
        return ""
    return f" of {' and '.join(drop.name for drop in problem.drops[:_DROPS])}"


def first_fits(few: Problem) -> Mapping[float, Fit]:
    """Return successive fits to the fall and the first contacts from the nominal values, by horizon, s.

    They end at the first horizon to which the model cannot be simulated.
    """
    fits: dict[float, Fit] = {}
    point = few.start
    for horizon in (STAGES.fall, *STAGES.first_contacts):
        found = fit_or_none(few, point, horizon, SLOPES)
        if found is None:
            break
        fits[horizon], point = found, found.point
    return fits
