"""A suspect fitted: roughly from where a score says, with slopes of its own, and from the fall on."""

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

_SMALLER = 0.3  # of the size that a score promises, where that is too much
_BALL_SIZES = (1.0, 2.5)  # of the typical size, at which a ball is begun in the fall
WAVE_PHASES = tuple(k * math.pi / 4 - math.pi for k in range(8))  # rad, tried of waves that stand still
_ROUGH_SLOPES = 2  # taken at each horizon of a rough fit
_ASTRAY = 2.0  # times what a cause leaves to the horizon, that it may leave on its way there


def begun(best: Contender, suspect: Suspect, start: Start, early: bool) -> Contender | None:
    """Return a contender with one cause more, fitted roughly from where a score says, or from elsewhere if that is no good.

    `early` says that what acts in contacts may begin at its usual size too.
    """
    tried = [_roughly(best, suspect, start)]
    if tried[0] is None or tried[0].misfit > best.misfit:  # the score saw a straight line further than it goes
        further = (suspect.smaller(start, _SMALLER), *(suspect.usual() if early else ()))
        tried += [_roughly(best, suspect, each) for each in further]
    return min((each for each in tried if each is not None), key=lambda each: each.bic, default=None)


def joined(best: Contender, suspect: Suspect, start: Start) -> Contender | None:
    """Return a contender with one cause more, not fitted yet; None where it cannot be simulated there."""
    try:
        return with_cause(best, suspect, start)
    except InputError:
        return None


def _roughly(best: Contender, suspect: Suspect, start: Start) -> Contender | None:
    """Return a contender with one cause more, fitted with the slopes that are known; None where that is impossible."""
    wider = joined(best, suspect, start)
    if wider is None:
        return None
    try:
        return replace(wider, fit=fit(wider.problem, wider.fit.point, best.horizon, 0, slopes=wider.fit.slopes))
    except InputError:
        return None


def with_own_slopes(contenders: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return those contenders that can be simulated, fitted anew."""
    return _apart(_anew, contenders, horizon)


def _apart(work: Callable[..., Contender | None], contenders: Sequence[Contender], *how: object) -> list[Contender]:
    """Return what some work makes of contenders, several at a time; without those of which it makes nothing."""
    if not contenders:
        return []
    found = contenders[0].problem.crew.apart(work, [(each, *how) for each in contenders])
    return [new.at_home(each, each.causes) for new, each in zip(found, contenders, strict=True) if new is not None]


def _anew(contender: Contender, horizon: float) -> Contender | None:
    """Return a contender fitted anew; which ball differs, or at which phase a ring is, is searched too."""
    problem, new, point = contender.problem, contender.causes[-1], contender.fit.point
    if new.standing_waves:
        found = [_round_the_race(problem, new, contender.fit, horizon)]
    elif new.drop_specific:
        found = [turned(problem, contender.fit, horizon)]
    else:
        found = [fit_or_none(problem, point, horizon, 1)]
    if new.counted is not None:
        # a ball too large on one side does much of what a smaller one, or one too small, does elsewhere
        found += [_from_usual_size(problem, new, point, way, horizon) for way in (1.0, -1.0)]
    best = min((each for each in found if each is not None), key=lambda each: each.misfit, default=None)
    return None if best is None else replace(contender, fit=best)


def _round_the_race(problem: Problem, cause: Suspect, found: Fit, horizon: float) -> Fit | None:
    """Return a fit of waves that stand still, from the best of phases all round a wave, each with the cages that suit it."""
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
    """Give a cause's parameter a value (SI) in a point."""
    at = next(k for k, p in enumerate(problem.shared) if p.name == f"{cause.name}.{parameter.name}")
    point[at] = (value - problem.shared[at].nominal) / problem.shared[at].scale


def turned(problem: Problem, found: Fit, horizon: float) -> Fit | None:
    """Return a fit after its cages and rings were turned to where they suit, twice; None where that is impossible."""
    try:
        for _ in range(2):
            found = fit(problem, turn_cages(problem, found, horizon), horizon, 1)
    except InputError:
        return None
    return found


def _from_usual_size(problem: Problem, cause: Suspect, point: Array, way: float, horizon: float) -> Fit | None:
    """Return the same from where a cause has its typical size, one way or the other."""
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
    """Return contenders fitted from the fall on, several at a time, each along the horizons up to its own.

    Who leaves more than `most`, the misfit of one that must be beaten, on the way already, goes no further.  A ball is begun at
    several sizes: how large it is, a fit that had made up for it by the horizon can hardly tell.
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
    """Return a contender whose last cause is a ball with others of sizes that it is tried at; none for another cause."""
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
    """Return `from_the_fall`; None where it cannot be simulated."""
    try:
        return from_the_fall(fallen, fitted, horizons, most)
    except InputError:
        return None


def from_the_fall(fallen: Contender, fitted: Contender, horizons: Sequence[float], most: float = math.inf) -> Contender:
    """Return a contender fitted from the fall on with its causes in place, or settled where it is if that is better.

    By the horizon at which a model fails its values have made up for what it lacks; a cause that joins there may end in
    another minimum.
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
    """Return the model with known causes and each of several more that can be simulated, fitted roughly from the fall on.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    known, further : sequence of pair
        Each cause and where it begins.
    horizons : sequence of float
        s, along which they are fitted; at the first, where nothing touches yet, the known causes alone.
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
    """Return the model with known causes and each of suspects, fitted roughly from its usual size in the fall to the contacts.

    The plain model makes up for the first contacts by gap, clearance and stiffness; a fit that begins there does not leave them.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    known : sequence of pair
        Each cause and where it begins.
    suspects : sequence of Suspect
    horizons : sequence of float
        s; those up to where both ends have touched are used.

    Returns
    -------
    list of Contender
        The best first, of each cause one.
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
    """Return those contenders that can be simulated, fitted along horizons with slopes taken so many times, several at a time.

    Who leaves more than `most`, the misfit of one that must be beaten, is none of them.
    """
    return _apart(_followed_on, contenders, horizons, slopes, most) if horizons else list(contenders)


def _followed_on(contender: Contender, horizons: Sequence[float], slopes: int, most: float) -> Contender | None:
    try:
        for horizon in horizons:
            contender = settled(contender, horizon, slopes)
            if contender.misfit > most:  # more readings leave no less
                return None
    except InputError:
        return None
    return contender
