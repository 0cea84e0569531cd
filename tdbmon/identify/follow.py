"""Fits to increasing horizons, from the first contacts to the last; rival minima are followed side by side at first.

The first contacts hardly determine a bearing's clearance: other combinations of gap, clearance and cage angles fit as well,
each a local minimum that a descent does not leave.  Only some contacts later can the right one be told.  So fits begun at the
corners of the clearances' prior range are followed in parallel, their number falling with the horizon.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.errors import InputError

from tdbmon.identify.clearances import better_clearances, corners, hardly_gained, led_along
from tdbmon.identify.least_squares import Fit, fit_or_none
from tdbmon.identify.own_paths import begun_at, better_paths, lost_drops
from tdbmon.identify.prediction import noise_alone
from tdbmon.identify.problem import Problem
from tdbmon.identify.stated_values import WORTH, fitted_with_stated_values
from tdbmon.identify.stray import led_back, stray_drop
from tdbmon.progress import Progress

Array = NDArray[np.float64]

FAILING = 1.1  # times the misfit of noise alone, from which on a model fails
_RIVALS = (0.014, 5), (0.018, 4), (0.022, 3), (0.04, 2)  # horizon, s in a usual gap, and number of rivals kept there
_HOPELESS = 1.05  # times the least misfit, from which on a rival is dropped
# s in a usual gap: at the first horizons from these on the cage angles of all drops are searched, since the contacts so far
# determine them, while the misfit of a wrong one may still be within noise
_CAGE_SEARCHES = (0.022, 0.027)
_LOST = 0.06  # s in a usual gap: a fit that fails from here on, the model's error included, is followed no further


@dataclass(frozen=True, eq=False)
class Passed:
    """The best fit to a horizon, s after the release."""

    horizon: float
    fit: Fit


def followed(
    problem: Problem, horizons: Sequence[float], progress: Progress, may_widen: bool = True
) -> tuple[Problem, list[Passed]]:
    """Return a problem and its fits from the first contacts to the last horizon.

    Where the misfit exceeds noise and freeing the values stated without tolerance, within their prior, removes half of the
    excess, everything is repeated with these values free.

    Parameters
    ----------
    problem : Problem
    horizons : sequence of float
        s after the release, increasing; those beyond 60 ms only while the misfit is within noise and the model's error.
    progress : callable
        Called with the name of each step as it begins.
    may_widen : bool
        Whether those values may be freed.

    Raises
    ------
    InputError
        If the fit leaves the range in which drops can be simulated.
    """
    way = _Continuation(problem, horizons)
    for horizon in horizons:
        progress(f"fitting the first {horizon * 1e3:g} ms")
        way.fit(horizon)
        way.seek_paths()
        way.lead_back()
        way.try_clearances()
        way.judge()
        if may_widen and (freed := way.freed()) is not None:
            progress("fitting also the values that the machine file states without tolerance")
            return followed(freed, horizons, progress, may_widen=False)
        way.try_clearances_again()
        way.lead_along()
        way.pass_on()
        if way.is_lost:
            break
    return problem, way.passed


class _Continuation:
    """Fits of a problem continued through the horizons; each step checks itself whether it applies.

    Attributes
    ----------
    horizon : float
        The present one, s after the release.
    rivals : list of Fit
        To this horizon, the best first.
    passed : list of Passed
        The best fit at each horizon from the touch of both ends on, and at the last one.
    """

    def __init__(self, problem: Problem, horizons: Sequence[float]) -> None:
        self.problem, self.horizons, self.stages = problem, horizons, problem.stages
        self.horizon, self.rivals, self.passed = 0.0, list[Fit](), list[Passed]()
        self._starts = [problem.start]
        self._noise = 0.0  # misfit that noise alone would leave
        self._fails = False
        self._clearances_gain = True  # of fits begun at neighbouring clearances, where tried
        self._touched = _first_beyond(horizons, self.stages.touched)
        self._cage_searches = [_first_beyond(horizons, instant) for instant in self.stages.all_at(_CAGE_SEARCHES)]

    @property
    def _is_sought(self) -> bool:
        return self.horizon <= self.stages.followed  # later all trajectories diverge anyway

    def fit(self, horizon: float) -> None:
        """Fit to a horizon from the fits to the one before."""
        self.horizon = horizon
        self.rivals = _best_first(self._in_parallel(fit_or_none, self._starts))
        self._noise = sum(noise_alone(drop, horizon) for drop in self.problem.drops)

    def seek_paths(self) -> None:
        """Search drops' own values anew once the cage angles matter: of all drops at `_CAGE_SEARCHES`, else of lost ones."""
        if self.stages.loaded < self.horizon and self._is_sought:
            tried = [(self.problem, rival, self.horizon, self.horizon in self._cage_searches) for rival in self.rivals]
            self.rivals = _best_first(self.problem.crew.apart(_with_better_paths, tried))

    def lead_back(self) -> None:
        """Lead back a single stray drop, once both ends have bounced."""
        if self.horizon < self.stages.bounced:
            return
        found = self.rivals[0]
        stray = stray_drop(found, FAILING * self._noise / sum(map(len, found.residuals)))
        if stray is not None:
            self.rivals = _best_first([led_back(self.problem, found, stray, self.horizon), *self.rivals[1:]])

    def try_clearances(self) -> None:
        """Begin at other clearances as soon as both ends have touched.

        A search of all angles of a drop and one of single cage angles end in different minima, and either may be right.
        """
        if self.horizon == self._touched and self._is_sought:
            found = self.rivals[0]
            turned = better_clearances(self.problem, found, self.horizon)
            begun = self._in_parallel(begun_at, corners(self.problem, found.point))
            self.rivals = _best_first([*([] if turned is found else [turned]), found, *begun])

    def judge(self) -> None:
        """Determine whether the best fit fails, which the later steps depend on."""
        self._fails = self.rivals[0].misfit > FAILING * self._noise

    def freed(self) -> Problem | None:
        """Return the problem with the values stated without tolerance free, if that removes half of the misfit beyond noise."""
        if not self._fails or not self.stages.touched <= self.horizon <= self.stages.at(_LOST):
            return None
        best = self.rivals[0]
        freed = fitted_with_stated_values(self.problem, best, self.horizon)
        if freed is None or best.misfit - freed[1].misfit <= WORTH * (best.misfit - self._noise):
            return None
        return freed[0]

    def try_clearances_again(self) -> None:
        """Begin at other clearances after the first contacts too, while the best fit fails."""
        if (
            self._fails
            and self._clearances_gain
            and self._is_sought
            and self.stages.touched < self.horizon != self._touched
        ):
            self.rivals = _best_first([better_clearances(self.problem, self.rivals[0], self.horizon), *self.rivals])

    def lead_along(self) -> None:
        """Begin at neighbouring clearances with a new search of own values, while the best fit fails and this gains."""
        if self._fails and self._clearances_gain and self.stages.bounced <= self.horizon and self._is_sought:
            led = led_along(self.problem, self.rivals[0], self.horizon)
            self._clearances_gain = not hardly_gained(self.rivals[0], led, self._noise)
            self.rivals = _best_first([led, *self.rivals[1:]])

    def pass_on(self) -> None:
        """Record the best fit, and start the next horizon from it and some rivals."""
        if self.horizon >= self.stages.touched or self.horizon == self.horizons[-1]:
            self.passed.append(Passed(self.horizon, self.rivals[0]))
        many = next((n for usual, n in _RIVALS if self.stages.at(usual) >= self.horizon), 1)
        self._starts = [each.point for each in self.rivals[:many]]

    @property
    def is_lost(self) -> bool:
        """Whether the best fit fails at a late horizon, the model's error included: it is then followed no further."""
        best = self.rivals[0]
        return self.horizon >= self.stages.at(_LOST) and best.misfit > FAILING * sum(map(len, best.residuals))

    def _in_parallel(
        self, step: Callable[[Problem, Array, float], Fit | None], points: Sequence[Array]
    ) -> list[Fit | None]:
        """Apply a step to each point in parallel."""
        return self.problem.crew.apart(step, [(self.problem, point, self.horizon) for point in points])


def _first_beyond(horizons: Sequence[float], instant: float) -> float | None:
    """Return the first horizon that reaches an instant."""
    return next((horizon for horizon in horizons if horizon >= instant), None)


def _best_first(tried: Sequence[Fit | None]) -> list[Fit]:
    """Return the fits near the least misfit, the best first."""
    reached = sorted((each for each in tried if each is not None), key=lambda each: each.misfit)
    if not reached:
        raise InputError("the fit left the range that can be simulated; check gap and probes of the machine file")
    return [each for each in reached if each.misfit <= _HOPELESS * reached[0].misfit]


def _with_better_paths(problem: Problem, found: Fit, horizon: float, everyone: bool) -> Fit:
    """Return a fit with own values of drops searched anew: of those whose misfit exceeds noise, or of all."""
    lost = range(len(problem.drops)) if everyone else lost_drops(problem, found, horizon)
    return better_paths(problem, found, horizon, lost) if lost else found
