"""Drops followed from the first contacts to the last horizon, several fits side by side while nothing tells which is right.

The first contacts say next to nothing of a bearing's clearance: they are met as well with other gaps, clearances and
angles of the cages, each a minimum of its own, and a descent leaves none of them.  Which is right shows some contacts
later.  So fits begun at the corners of what is known of the clearances are followed beside each other, fewer and fewer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tdbsim.errors import InputError

from tdbmon.identify.clearances import TOUCHED_S, better_clearances, corners, hardly_gained, led_along
from tdbmon.identify.least_squares import Fit, fit_or_none
from tdbmon.identify.own_paths import begun_at, better_paths, lost_drops
from tdbmon.identify.prediction import noise_alone
from tdbmon.identify.problem import Problem
from tdbmon.identify.stated_values import WORTH, fitted_with_stated_values
from tdbmon.identify.stray import STRAYED_S, led_back, stray_drop
from tdbmon.progress import Progress

CONTACT_S = 0.009  # s; before it the cages' angles do nothing
FAILING = 1.1  # times what noise leaves, from which on a model fails
_RIVALS = ((0.014, 5), (0.018, 4), (0.022, 3), (0.04, 2))  # s after the release, and how many go on from there
_HOPELESS = 1.05  # times the least misfit, from which on a rival is given up
# s; the contacts so far tell the cages' angles, and a wrong one hides within the noise still
_TELLING_S = (0.022, 0.027)
_SOUGHT_S = 0.04  # s; a path that is lost later ends where trajectories part anyway
_LATE_S = 0.06  # s; who leaves more there than noise and the model's error is followed no further


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
    starts, passed, leads = [problem.start], list[Passed](), True
    for horizon in horizons:
        progress(f"fitting the first {horizon * 1e3:g} ms")
        rivals = _deepest(problem.crew.apart(fit_or_none, [(problem, start, horizon) for start in starts]))
        if CONTACT_S < horizon <= _SOUGHT_S:
            rivals = _deepest(problem.crew.apart(_led_on, [(problem, rival, horizon) for rival in rivals]))
        found, noise = rivals[0], sum(noise_alone(drop, horizon) for drop in problem.drops)
        stray = stray_drop(found, FAILING * noise / sum(map(len, found.residuals))) if horizon >= STRAYED_S else None
        if stray is not None:
            rivals = _deepest([led_back(problem, found, stray, horizon), *rivals[1:]])
        if horizon == TOUCHED_S:
            # whole paths sought lead elsewhere than angles of cages turned one by one, and either may lead right
            turned = better_clearances(problem, found, horizon)
            begun = [(problem, corner, horizon) for corner in corners(problem, found.point)]
            rivals = _deepest([*{found, turned}, *problem.crew.apart(begun_at, begun)])
        fails = rivals[0].misfit > FAILING * noise
        if fails and may_widen and TOUCHED_S <= horizon <= _LATE_S:
            freed = fitted_with_stated_values(problem, rivals[0], horizon)
            if freed is not None and rivals[0].misfit - freed[1].misfit > WORTH * (rivals[0].misfit - noise):
                progress("fitting what the machine file states without tolerance too")
                return followed(freed[0], horizons, progress, may_widen=False)
        if fails and leads and TOUCHED_S < horizon <= _SOUGHT_S:
            rivals = _deepest([better_clearances(problem, rivals[0], horizon), *rivals])
        if fails and leads and STRAYED_S <= horizon <= _SOUGHT_S:
            led = led_along(problem, rivals[0], horizon)
            leads = not hardly_gained(rivals[0], led, noise)
            rivals = _deepest([led, *rivals[1:]])
        if horizon >= TOUCHED_S or horizon == horizons[-1]:
            passed.append(Passed(horizon, rivals[0]))
        if horizon >= _LATE_S and rivals[0].misfit > FAILING * sum(map(len, rivals[0].residuals)):
            break
        starts = [each.point for each in rivals[: next((n for h, n in _RIVALS if h >= horizon), 1)]]
    return problem, passed


def _deepest(tried: Sequence[Fit | None]) -> list[Fit]:
    """Return the fits that reach near the least misfit, the deepest first."""
    reached = sorted((each for each in tried if each is not None), key=lambda each: each.misfit)
    if not reached:
        raise InputError("the fit left what can be simulated; check gap and probes of the machine file")
    return [each for each in reached if each.misfit <= _HOPELESS * reached[0].misfit]


def _led_on(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return a fit with the paths of drops sought anew: of those that leave more than noise, of all where it tells most."""
    lost = range(len(problem.drops)) if horizon in _TELLING_S else lost_drops(problem, found, horizon)
    return better_paths(problem, found, horizon, lost) if lost else found
