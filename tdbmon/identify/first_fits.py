"""The plain model fitted to the first contacts of two drops: by these fits it is judged whether the machine file is right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from tdbmon.identify.least_squares import Fit, fit_or_none
from tdbmon.identify.problem import Problem

FALL_S = 0.006  # s after the release: nothing touches
FIRST_CONTACTS_S = (0.01, 0.014, 0.018)  # s: past a first contact, and no more than takes a second or two
SLOPES = 4  # of each fit
_DROPS = 2  # that are looked at


def few_drops(problem: Problem) -> Problem:
    """Return a problem of the first two drops."""
    return replace(problem, drops=problem.drops[:_DROPS], own=problem.own[:_DROPS])


def first_fits(few: Problem, horizons: Sequence[float] = (FALL_S, *FIRST_CONTACTS_S)) -> Mapping[float, Fit]:
    """Return fits from the nominal values on, by their horizons in s; none beyond where the model cannot be simulated."""
    fits: dict[float, Fit] = {}
    point = few.start
    for horizon in horizons:
        found = fit_or_none(few, point, horizon, SLOPES)
        if found is None:
            break
        fits[horizon], point = found, found.point
    return fits
