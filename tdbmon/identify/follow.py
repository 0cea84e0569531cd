"""Drops followed from the first contacts to the last horizon, several fits side by side while nothing tells which is right.

The first contacts say next to nothing of a bearing's clearance: they are met as well with other gaps, clearances and
angles of the cages, each a minimum of its own, and a descent leaves none of them.  Which is right shows some contacts
later.  So fits begun at the corners of what is known of the clearances are followed beside each other, fewer and fewer.
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

FAILING = 1.1  # times what noise leaves, from which on a model fails
_RIVALS = (0.014, 5), (0.018, 4), (0.022, 3), (0.04, 2)  # s in a usual gap, and how many go on from there
_HOPELESS = 1.05  # times the least misfit, from which on a rival is given up
# s in a usual gap: at the first horizons from there on the contacts so far tell the cages' angles, and a wrong one hides within
# the noise still
_TELLING = (0.022, 0.027)
_LOST = 0.06  # s in a usual gap; who leaves more there than noise and the model's error is followed no further


@dataclass(frozen=True, eq=False)
class Passed:
    """A fit on the way, to a horizon in s after the release."""

    horizon: float
    fit: Fit


def followed(
    problem: Problem, horizons: Sequence[float], progress: Progress, may_widen: bool = True
) -> tuple[Problem, list[Passed]]:
    """Return a problem and its fits on the way, from the first contacts to the last horizon.

    As soon as it leaves more than noise, and the values without tolerance, moved within what is known of them, take away half
    of that, all of it is done again with them free.

    Parameters
    ----------
    problem : Problem
    horizons : sequence of float
        s after the release, growing; those beyond 60 ms as long as no more is left than noise and the model's error.
    progress : callable
        Is told the name of each step as it begins.
    may_widen : bool
        Whether those values may be freed.

    Raises
    ------
    InputError
        If the fit leaves what can be simulated.
    """
    way = _Way(problem, horizons)
    for horizon in horizons:
        progress(f"fitting the first {horizon * 1e3:g} ms")
        way.fit(horizon)
        way.seek_paths()
        way.lead_back()
        way.try_clearances()
        way.judge()
        if may_widen and (freed := way.freed()) is not None:
            progress("fitting what the machine file states without tolerance too")
            return followed(freed, horizons, progress, may_widen=False)
        way.try_clearances_again()
        way.lead_along()
        way.pass_on()
        if way.is_lost:
            break
    return problem, way.passed


class _Way:
    """Fits of a problem on their way through horizons; each step says itself when it is to be taken.

    Attributes
    ----------
    horizon : float
        That of the step, s after the release.
    rivals : list of Fit
        To this horizon, the deepest first.
    passed : list of Passed
        The deepest at each horizon, from where both ends have touched on, and at the last one.
    """

    def __init__(self, problem: Problem, horizons: Sequence[float]) -> None:
        self.problem, self.horizons, self.stages = problem, horizons, problem.stages
        self.horizon, self.rivals, self.passed = 0.0, list[Fit](), list[Passed]()
        self._starts = [problem.start]
        self._noise = 0.0  # misfit that noise alone would leave
        self._fails = False
        self._leads = True  # fits begun beside the clearances gained something, as far as that was tried
        self._touched = _first_beyond(horizons, self.stages.touched)
        self._telling = [_first_beyond(horizons, instant) for instant in self.stages.all_at(_TELLING)]

    @property
    def _is_sought(self) -> bool:
        return self.horizon <= self.stages.followed  # a path that is lost later ends where trajectories part anyway

    def fit(self, horizon: float) -> None:
        """Fit to a horizon from where those before ended."""
        self.horizon = horizon
        self.rivals = _deepest(self._apart(fit_or_none, self._starts))
        self._noise = sum(noise_alone(drop, horizon) for drop in self.problem.drops)

    def seek_paths(self) -> None:
        """Seek the paths of drops anew, once the cages' angles do something: of all where it tells most, else of the lost."""
        if self.stages.loaded < self.horizon and self._is_sought:
            tried = [(self.problem, rival, self.horizon, self.horizon in self._telling) for rival in self.rivals]
            self.rivals = _deepest(self.problem.crew.apart(_led_on, tried))

    def lead_back(self) -> None:
        """Lead back the one drop that has strayed, once both ends have touched twice."""
        if self.horizon < self.stages.bounced:
            return
        found = self.rivals[0]
        stray = stray_drop(found, FAILING * self._noise / sum(map(len, found.residuals)))
        if stray is not None:
            self.rivals = _deepest([led_back(self.problem, found, stray, self.horizon), *self.rivals[1:]])

    def try_clearances(self) -> None:
        """Begin at other clearances, as soon as both ends have touched.

        Whole paths sought lead elsewhere than angles of cages turned one by one, and either may lead right.
        """
        if self.horizon == self._touched and self._is_sought:
            found = self.rivals[0]
            turned = better_clearances(self.problem, found, self.horizon)
            begun = self._apart(begun_at, corners(self.problem, found.point))
            self.rivals = _deepest([*([] if turned is found else [turned]), found, *begun])

    def judge(self) -> None:
        """Say whether the best leaves more than noise, which the steps from here on ask for."""
        self._fails = self.rivals[0].misfit > FAILING * self._noise

    def freed(self) -> Problem | None:
        """Return the problem with the values without tolerance free, if they take away half of what is left beyond noise."""
        if not self._fails or not self.stages.touched <= self.horizon <= self.stages.at(_LOST):
            return None
        best = self.rivals[0]
        freed = fitted_with_stated_values(self.problem, best, self.horizon)
        if freed is None or best.misfit - freed[1].misfit <= WORTH * (best.misfit - self._noise):
            return None
        return freed[0]

    def try_clearances_again(self) -> None:
        """Begin at other clearances after the first contacts too, while more than noise is left."""
        if self._fails and self._leads and self._is_sought and self.stages.touched < self.horizon != self._touched:
            self.rivals = _deepest([better_clearances(self.problem, self.rivals[0], self.horizon), *self.rivals])

    def lead_along(self) -> None:
        """Begin beside the clearances with paths sought there, while more than noise is left and it gains something."""
        if self._fails and self._leads and self.stages.bounced <= self.horizon and self._is_sought:
            led = led_along(self.problem, self.rivals[0], self.horizon)
            self._leads = not hardly_gained(self.rivals[0], led, self._noise)
            self.rivals = _deepest([led, *self.rivals[1:]])

    def pass_on(self) -> None:
        """Keep the best, and let it and some rivals go on from where they ended."""
        if self.horizon >= self.stages.touched or self.horizon == self.horizons[-1]:
            self.passed.append(Passed(self.horizon, self.rivals[0]))
        many = next((n for usual, n in _RIVALS if self.stages.at(usual) >= self.horizon), 1)
        self._starts = [each.point for each in self.rivals[:many]]

    @property
    def is_lost(self) -> bool:
        """Whether the best leaves so late more than noise and the model's error: it is followed no further."""
        best = self.rivals[0]
        return self.horizon >= self.stages.at(_LOST) and best.misfit > FAILING * sum(map(len, best.residuals))

    def _apart(self, step: Callable[[Problem, Array, float], Fit | None], points: Sequence[Array]) -> list[Fit | None]:
        """Return what a step makes of points, each where the crew has room."""
        return self.problem.crew.apart(step, [(self.problem, point, self.horizon) for point in points])


def _first_beyond(horizons: Sequence[float], instant: float) -> float | None:
    """Return the first horizon that reaches an instant."""
    return next((horizon for horizon in horizons if horizon >= instant), None)


def _deepest(tried: Sequence[Fit | None]) -> list[Fit]:
    """Return the fits that reach near the least misfit, the deepest first."""
    reached = sorted((each for each in tried if each is not None), key=lambda each: each.misfit)
    if not reached:
        raise InputError("the fit left what can be simulated; check gap and probes of the machine file")
    return [each for each in reached if each.misfit <= _HOPELESS * reached[0].misfit]


def _led_on(problem: Problem, found: Fit, horizon: float, everyone: bool) -> Fit:
    """Return a fit with the paths of drops sought anew: of those that leave more than noise, or of all."""
    lost = range(len(problem.drops)) if everyone else lost_drops(problem, found, horizon)
    return better_paths(problem, found, horizon, lost) if lost else found
