"""Fits of a suspect: roughly from its score's start point, with a Jacobian of its own, and from the fall on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.effect import Parameter as Declared
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import (
    FEW_SLOPES,
    SLOPES,
    Contender,
    best_of_each_name,
    settled,
    with_cause,
    with_causes,
)
from tdbmon.diagnosis.effect_size import sized
from tdbmon.diagnosis.suspects import Start, Suspect
from tdbmon.identify.cages import turn_cages
from tdbmon.identify.least_squares import Fit, fit, fit_or_none, linearised
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_SMALLER = 0.3  # share of the size that a score suggests, tried where the suggested size fits worse than none
_BALL_SIZES = (1.0, 2.5)  # multiples of the typical size at which the fit of a ball starts in the fall
WAVE_PHASES = tuple(k * math.pi / 4 - math.pi for k in range(8))  # rad, start phases of standing waves
_ROUGH_SLOPES = 2  # Jacobians at each horizon of a rough fit
_ASTRAY = 2.0  # greatest misfit ratio at an earlier horizon, in units of that at the last one


def begun(best: Contender, suspect: Suspect, start: Start, early: bool) -> Contender | None:
    """Return the contender with one more cause, fitted roughly from its score's start point, or from others if that fails.

    `early`: also start contact causes at their usual size.
    """
    tried = [_roughly(best, suspect, start)]
    if tried[0] is None or tried[0].misfit > best.misfit:  # the score extrapolated linearly too far
        further = (suspect.smaller(start, _SMALLER), *(suspect.usual() if early else ()))
        tried += [_roughly(best, suspect, each) for each in further]
    return min((each for each in tried if each is not None), key=lambda each: each.bic, default=None)


def joined(best: Contender, suspect: Suspect, start: Start) -> Contender | None:
    """Return the contender with one more cause, not yet fitted; None if it cannot be simulated at the start point."""
    try:
        return with_cause(best, suspect, start)
    except InputError:
        return None


def _roughly(best: Contender, suspect: Suspect, start: Start) -> Contender | None:
    """Return the contender with one more cause, fitted with the Jacobian already known; None if it cannot be simulated."""
    wider = joined(best, suspect, start)
    if wider is None:
        return None
    try:
        return replace(wider, fit=fit(wider.problem, wider.fit.point, best.horizon, 0, slopes=wider.fit.slopes))
    except InputError:
        return None


def with_own_slopes(contenders: Sequence[Contender], horizon: float) -> list[Contender]:
    """Refit each contender with a Jacobian of its own; leave out those that cannot be simulated."""
    return _in_parallel(_with_own_jacobian, contenders, horizon)


def _in_parallel(
    work: Callable[..., Contender | None], contenders: Sequence[Contender], *how: object
) -> list[Contender]:
    """Apply `work` to the contenders in parallel and return the results other than None."""
    if not contenders:
        return []
    found = contenders[0].problem.crew.apart(work, [(each, *how) for each in contenders])
    return [new.at_home(each, each.causes) for new, each in zip(found, contenders, strict=True) if new is not None]


def _with_own_jacobian(contender: Contender, horizon: float) -> Contender | None:
    """Return the contender refitted, its last cause's ball number or ring phases searched as well; None if impossible."""
    problem, new, point = contender.problem, contender.causes[-1], contender.fit.point
    if new.standing_waves:
        found = [_round_the_race(problem, new, contender.fit, horizon)]
    elif new.drop_specific:
        found = [turned(problem, contender.fit, horizon)]
    else:
        found = [fit_or_none(problem, point, horizon, 1)]
    if new.counted is not None:
        # one ball that is too large acts much like another that is too small: a fit that starts at one stays there
        found += [_from_usual_size(problem, new, point, way, horizon) for way in (1.0, -1.0)]
    best = min((each for each in found if each is not None), key=lambda each: each.misfit, default=None)
    return None if best is None else replace(contender, fit=best)


def _round_the_race(problem: Problem, cause: Suspect, found: Fit, horizon: float) -> Fit | None:
    """Return a fit of standing waves, started at the best of `WAVE_PHASES`, each with its own best cage angles."""
    tried = [found]
    for phase in WAVE_PHASES:
        point = found.point.copy()
        for size, angle in cause.sizes:
            _set(problem, point, cause, size, size.typical)
            if angle is not None:
                _set(problem, point, cause, angle, phase)
        try:
            point = turn_cages(problem, replace(found, point=np.clip(point, problem.low, problem.high)), horizon)
            tried.append(fit(problem, point, horizon, 0, slopes=found.slopes))
        except InputError:
            continue
    return turned(problem, min(tried, key=lambda each: each.misfit), horizon)


def _set(problem: Problem, point: Array, cause: Suspect, parameter: Declared, value: float) -> None:
    """Set a cause's parameter (SI) in a point."""
    at = next(k for k, p in enumerate(problem.shared) if p.name == f"{cause.name}.{parameter.name}")
    point[at] = (value - problem.shared[at].nominal) / problem.shared[at].scale


def turned(problem: Problem, found: Fit, horizon: float) -> Fit | None:
    """Return the fit after two searches for the angles of its cages and rings; None if it cannot be simulated."""
    try:
        for _ in range(2):
            found = fit(problem, turn_cages(problem, found, horizon), horizon, 1)
    except InputError:
        return None
    return found


def _from_usual_size(problem: Problem, cause: Suspect, point: Array, way: float, horizon: float) -> Fit | None:
    """Return a fit that starts at the cause's typical size, of either sign (`way` ±1); None if it cannot be simulated."""
    other = point.copy()
    for size, _ in cause.sizes:
        _set(problem, other, cause, size, sized(size, way))
    try:
        start = linearised(problem, np.clip(other, problem.low, problem.high), horizon)
    except InputError:
        return None
    return turned(problem, start, horizon)


def all_from_the_fall(
    fallen: Contender, contenders: Sequence[Contender], horizons: Sequence[float], most: float = math.inf
) -> list[Contender]:
    """Return the contenders fitted from the fall on in parallel, each along the horizons up to its own.

    A fit stops as soon as its misfit exceeds `most`, the misfit to beat.  A ball starts at several sizes, since a fit whose
    other values have compensated for the ball by the horizon hardly determines its size.
    """
    begun = [(each, start) for each in contenders for start in (each, *_balls(each))]
    tasks = [(fallen, start, [h for h in horizons if h <= each.horizon], most) for each, start in begun]
    found = fallen.problem.crew.apart(from_the_fall_or_none, tasks)
    best: dict[Contender, Contender] = {}
    for (each, _), new in zip(begun, found, strict=True):
        if new is not None and (each not in best or new.misfit < best[each].misfit):
            best[each] = new.at_home(each, each.causes)
    return [best[each] for each in contenders if each in best]


def _balls(contender: Contender) -> list[Contender]:
    """Return the contender with its last cause, a ball, at each of `_BALL_SIZES`; nothing for another cause."""
    if not contender.causes or contender.causes[-1].counted is None:
        return []
    cause, problem = contender.causes[-1], contender.problem
    size, _ = cause.sizes[0]
    way = math.copysign(1.0, contender.starts()[-1].shared[size.name])
    points = [contender.fit.point.copy() for _ in _BALL_SIZES]
    for point, share in zip(points, _BALL_SIZES, strict=True):
        _set(problem, point, cause, size, sized(size, way * share))
    return [
        replace(contender, fit=replace(contender.fit, point=np.clip(point, problem.low, problem.high)))
        for point in points
    ]


def from_the_fall_or_none(
    fallen: Contender, fitted: Contender, horizons: Sequence[float], most: float = math.inf
) -> Contender | None:
    """Return `from_the_fall`; None if the model cannot be simulated."""
    try:
        return from_the_fall(fallen, fitted, horizons, most)
    except InputError:
        return None


def from_the_fall(fallen: Contender, fitted: Contender, horizons: Sequence[float], most: float = math.inf) -> Contender:
    """Return the contender fitted from the fall on with its causes in place, or refitted from its present values if better.

    By the horizon at which a model fails, its values have compensated for the missing cause; a cause that is added there may
    end in a wrong minimum.
    """
    settled_here = settled(fitted, horizons[-1], FEW_SLOPES)
    try:
        anew = with_causes(fallen, fitted.known)
        for horizon in horizons:
            anew = settled(anew, horizon, SLOPES)
            if anew.ratio > _ASTRAY * settled_here.ratio or anew.misfit > most:
                return settled_here
    except InputError:
        return settled_here
    return min(settled_here, anew, key=lambda each: each.misfit)


def roughly_from_the_fall(
    fallen: Contender,
    known: Sequence[tuple[Suspect, Start]],
    further: Sequence[tuple[Suspect, Start]],
    horizons: Sequence[float],
) -> list[Contender]:
    """Return the model with the known causes and each of the further ones in turn, fitted roughly from the fall on.

    Those that cannot be simulated are left out.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    known, further : sequence of pair
        Cause and start point.
    horizons : sequence of float
        s; the first, before any contact, is fitted with the known causes alone.
    """
    first, *later = horizons
    try:
        bare = settled(with_causes(fallen, known), first, SLOPES)
    except InputError:
        return []
    found = fallen.problem.crew.apart(_roughly_along, [(bare, each, later) for each in further])
    return [
        new.at_home(fallen, (*bare.causes, cause))
        for new, (cause, _) in zip(found, further, strict=True)
        if new is not None
    ]


def at_usual_size(
    fallen: Contender,
    known: Sequence[tuple[Suspect, Start]],
    suspects: Sequence[Suspect],
    horizons: Sequence[float],
) -> list[Contender]:
    """Return the model with the known causes and each suspect, fitted roughly from the fall on, from its usual size.

    At the first contacts gap, clearance and stiffness compensate for a missing cause, and a fit that starts there keeps those
    values.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    known : sequence of pair
        Cause and start point.
    suspects : sequence of Suspect
    horizons : sequence of float
        s; those up to the instant by which both ends have touched are used.

    Returns
    -------
    list of Contender
        The best first, one per cause.
    """
    begun = [(each, start) for each in suspects for start in each.usual()]
    return best_of_each_name(
        roughly_from_the_fall(fallen, known, begun, [h for h in horizons if h <= fallen.problem.stages.touched])
    )


def _roughly_along(bare: Contender, further: tuple[Suspect, Start], horizons: Sequence[float]) -> Contender | None:
    try:
        found = with_cause(bare, *further)
        for horizon in horizons:
            found = replace(found, fit=fit(found.problem, found.fit.point, horizon, _ROUGH_SLOPES), horizon=horizon)
    except InputError:
        return None
    return found


def followed_on(
    contenders: Sequence[Contender], horizons: Sequence[float], slopes: int = SLOPES, most: float = math.inf
) -> list[Contender]:
    """Return the contenders fitted along the horizons in parallel, with `slopes` Jacobians at each.

    Left out are those that cannot be simulated and those whose misfit exceeds `most`, the misfit to beat.
    """
    return _in_parallel(_followed_on, contenders, horizons, slopes, most) if horizons else list(contenders)


def _followed_on(contender: Contender, horizons: Sequence[float], slopes: int, most: float) -> Contender | None:
    try:
        for horizon in horizons:
            contender = settled(contender, horizon, slopes)
            if contender.misfit > most:  # further readings cannot lower it
                return None
    except InputError:
        return None
    return contender
