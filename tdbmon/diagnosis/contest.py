"""Models that compete for the drops: the plain one, and those that a suspect or two extend.

The horizon grows from the free fall past the first contacts.  As soon as the best model fails, every suspect is fitted
to as far as it came: roughly, with slopes that are known; those that come out best once more with their own.  They go on
with it; those that fall behind drop out.  So the competition takes place where the model begins to fail, before wrong
values have made up for what it lacks.

Where the plain model is the best as far as all are followed, it is followed further, for what acts later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import (
    FEW_SLOPES,
    FOLLOWED_S,
    SIMPLER,
    SLOPES,
    Contender,
    leader,
    replaced,
    settled,
    without_each,
)
from tdbmon.diagnosis.neighbouring_orders import in_neighbouring_orders, neighbours
from tdbmon.diagnosis.search import SOUND_S, Progress, Search
from tdbmon.diagnosis.stated import explained_by_stated_values, with_stated_values_free
from tdbmon.diagnosis.suspects import Suspect
from tdbmon.diagnosis.twins import twins
from tdbmon.identify.clearances import TOUCHED_S, better_clearances
from tdbmon.identify.draws import shaken
from tdbmon.identify.least_squares import fit
from tdbmon.identify.problem import Problem

# s after the release; in small steps, since a fit that is right to one leads into the right minimum of the next
HORIZONS = (0.006, 0.01, 0.014, 0.018, 0.022, 0.027, 0.033, FOLLOWED_S, 0.047, 0.055, 0.065)
_HIGHEST_FLOOR = 0.9  # misfit a residual of noise alone: large residuals count less than their square
_KEPT = 3  # contenders that go on to the next horizon
_EARLIEST_S = 0.022  # s; until then both ends have touched, and mostly twice
_AHEAD = 100.0  # in the criterion: who leads by so much has won
_DOUBT = 0.5  # of what it leaves beyond noise itself, by which it must be further ahead
_BEHIND = 1.5  # times the best ratio: who leaves more does not go on
_LOST, _LOST_HORIZONS = 3.0, 2  # the best ratio at so many horizons running, where it is no use to go on
_FAILED_BY_THEN = (
    1.25  # times what a cause leaves, that the plain model must leave where it is judged at an earlier horizon
)
_GIVEN_UP = 1.8  # the same where no search is left
_ACTS_LATER = 2.5  # times the floor: more than a path makes that only parts
_NEARLY = 2.0  # misfit a residual, from which on a model that another halves is hopeless


def contest(
    problem: Problem, suspects: Sequence[Suspect], horizons: Sequence[float], progress: Progress
) -> list[Contender]:
    """Return the contenders at the last horizon, the best first; the plain model is always among them.

    Raises
    ------
    InputError
        If the plain model cannot be simulated.
    """
    fallen = fit(problem, problem.start, horizons[0], SLOPES)
    # an effect may show in the fall already: then the noise is no less than it was before the release
    floor = min(fallen.misfit / sum(len(r) for r in fallen.residuals), _HIGHEST_FLOOR)
    plain = Contender((), problem, fallen, horizons[0], floor)
    search = Search(plain, suspects, horizons, progress)
    field: list[Contender] = []
    sound: tuple[Contender, ...] = ()
    compared: list[Suspect] = []  # waves and lobes whose neighbouring orders were tried, and those
    lost, decided, free = 0, False, False
    followed: tuple[Contender, list[Contender]] | None = None
    reached = horizons[0]
    for horizon in horizons:
        if horizon > FOLLOWED_S and followed is None:
            if leader(plain, field, reached).causes:
                horizon = reached
                break
            followed = plain, field
        progress(f"fitting the first {horizon * 1e3:g} ms")
        hopeless = decided or (plain.ratio > _NEARLY and any(plain.ratio > 2 * each.ratio for each in field))
        if not hopeless:
            plain = settled(plain, horizon, SLOPES)
        field = _refitted(field, horizon)
        if hopeless and all(each.fails for each in field):  # how much is left, is judged by what it leaves
            plain = settled(plain, horizon, FEW_SLOPES)
        best = leader(plain, field, horizon)
        if horizon == TOUCHED_S:
            deeper = replace(best, fit=better_clearances(best.problem, best.fit, horizon))
            plain, field, best = replaced(plain, field, best, deeper)
        if best.causes and best.fails_beside(plain):  # it may only sit in the wrong hollow
            deeper = replace(best, fit=shaken(best.problem, best.fit, horizon))
            cause = deeper.causes[-1]
            if deeper.fails_beside(plain) and cause not in compared:
                near = neighbours(cause, suspects)
                compared += [cause, *near]
                deeper = in_neighbouring_orders(search.fallen, deeper, near, horizons)
            plain, field, best = replaced(plain, field, best, deeper)
        if not free and best.fails_beside(plain) and explained_by_stated_values(best):
            progress("fitting what the machine file states without tolerance too")
            free = True
            freed = with_stated_values_free(search.fallen, [plain, *field], horizons)
            if freed is not None:
                search.fallen, (plain, *field) = freed
                sound = ()
        plain, field = search.compared(plain, field, horizon)
        best = min([plain, *field], key=lambda each: each.ratio)
        field = _kept(field)
        fine = any(not each.fails_beside(plain) for each in field)
        if sound and not fine:
            earlier = settled(plain, sound[0].horizon, SLOPES)
            # where the plain model had failed by then, what held up to here is the better witness: neighbouring paths part
            if earlier.ratio > _FAILED_BY_THEN * min(each.ratio for each in sound):
                plain, field, horizon = earlier, list(sound), earlier.horizon
                break
        sound = tuple(field) if fine and horizon >= SOUND_S else ()
        # where nothing explains the first contacts, nothing will explain the later ones
        lost = lost + 1 if best.ratio > _LOST else 0
        if lost >= (_LOST_HORIZONS if followed is None else 1):
            break
        if not search.rounds and best.ratio > _GIVEN_UP and horizon >= _EARLIEST_S:
            break
        if not decided and horizon >= _EARLIEST_S and _decided(plain, field, horizon):
            decided, field = True, [leader(plain, field, horizon)]
        reached = horizon
    if plain.horizon < horizon:
        plain = settled(plain, horizon, FEW_SLOPES)
    if followed is not None and plain.ratio < _ACTS_LATER * plain.floor and leader(plain, field, horizon).fails:
        plain, field = followed  # paths with impacts part
        horizon = plain.horizon
    plain, field = _simplified(plain, field)
    best = leader(plain, field, horizon)
    seen = {frozenset(cause.name for cause in each.causes) for each in field}
    field += [each for each in twins(best, suspects) if frozenset(cause.name for cause in each.causes) not in seen]
    return sorted([plain, *field], key=lambda each: each.bic)


def _simplified(plain: Contender, field: list[Contender]) -> tuple[Contender, list[Contender]]:
    """Return the models with those among them that need a cause less and leave noise alone just as well."""
    while field:
        best = min(field, key=lambda each: each.bic)
        simpler = []
        for freed in without_each(best, best.horizon):
            # a model that is nowhere near without a cause needs it
            near = settled(freed, best.horizon, SLOPES) if freed.ratio < 2 * _NEARLY * best.ratio else freed
            if not near.fails_beside(plain) and near.bic < best.bic + SIMPLER:
                simpler.append(near)
        if not simpler:
            break
        kept = min(simpler, key=lambda each: each.bic)
        field = [each for each in field if len(each.causes) <= len(kept.causes) and each.name != kept.name]
        if not kept.causes:
            plain = min(plain, kept, key=lambda each: each.misfit)
            break
        field.append(kept)
    return plain, field


def _decided(plain: Contender, field: Sequence[Contender], horizon: float) -> bool:
    """True where one model leaves noise alone and no other comes near: it goes on alone."""
    ranked = sorted((each for each in field if each.horizon == horizon), key=lambda each: each.bic)
    if not ranked or ranked[0].fails_beside(plain) or plain.ratio < _BEHIND * ranked[0].ratio:
        return False
    mine = {cause.name for cause in ranked[0].causes}
    rivals = [each for each in ranked[1:] if {cause.name for cause in each.causes} != mine]
    return all(each.bic > ranked[0].bic + _AHEAD + _DOUBT * ranked[0].excess for each in rivals)


def _kept(field: Sequence[Contender]) -> list[Contender]:
    """Return the contenders that go on: the best, and those not far behind."""
    ranked = sorted(field, key=lambda each: each.bic)[:_KEPT]
    return [each for each in ranked if each.ratio < _BEHIND * ranked[0].ratio]


def _refitted(field: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return the contenders fitted to a horizon, the leader with most care."""
    out = []
    for place, each in enumerate(sorted(field, key=lambda each: each.bic)):
        try:
            out.append(settled(each, horizon, SLOPES if place == 0 else FEW_SLOPES))
        except InputError:
            continue
    return out
