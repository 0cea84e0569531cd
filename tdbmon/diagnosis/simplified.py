"""Simpler models in the place of those that need a cause less."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import (
    HARDLY,
    SIMPLER,
    SLOPES,
    Contender,
    settled,
    with_cause,
    without_cause,
    without_each,
)
from tdbmon.diagnosis.suspects import Start, may_act_at_both_ends

HOPELESS = 2.0  # misfit a residual, from which on a model that another halves is hopeless
_MOST_OF_IT = 0.1  # of what the plain model leaves beyond noise, that a cause leaves which explains nearly all


def simplified(plain: Contender, field: list[Contender]) -> tuple[Contender, list[Contender]]:
    """Return the models with those among them that need a cause less and leave noise alone just as well."""
    while field:
        best = min(field, key=lambda each: each.bic)
        simpler = []
        for freed in (*without_each(best, best.horizon), *at_both_ends(best)):
            # a model that is nowhere near without a cause needs it
            near = settled(freed, best.horizon, SLOPES) if freed.ratio < 2 * HOPELESS * best.ratio else freed
            # who leaves as much with a cause less is the better model, whether it fails or not
            needless = near.bic < best.bic + (0.0 if near.fails_beside(plain) else SIMPLER)
            if needless or only_accompanies(best, near, plain):
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


def at_both_ends(best: Contender) -> list[Contender]:
    """Return a contender with a cause at both ends alike in the place of two that are the same but for their end.

    A search that adds one cause at a time finds an effect of both ends so.  It begins midway between their values, with the
    angle of the first, and is not fitted yet.
    """
    found = []
    for (first, one), (second, other) in combinations(enumerate(best.causes), 2):
        if not may_act_at_both_ends(one, other):
            continue
        mine, yours = (best.starts()[index].shared for index in (first, second))
        angles = {angle.name for angle in one.angles}
        midway = {name: value if name in angles else (value + yours[name]) / 2 for name, value in mine.items()}
        try:
            bare = without_cause(without_cause(best, second), first)
            found.append(with_cause(bare, replace(one, where="both"), Start(midway)))
        except InputError:
            continue
    return found


def only_accompanies(best: Contender, near: Contender, plain: Contender) -> bool:
    """True where the cause that a model has beyond a nearer one only fits what laws that are a little off leave of it.

    With angles or a number of its own in every drop it fits much that is not there.
    """
    gone = [cause for cause in best.causes if cause.name not in near.effects]
    return bool(near.causes and gone) and all(cause.drop_specific for cause in gone) and hardly_fails(near, plain)


def hardly_fails(each: Contender, plain: Contender) -> bool:
    """True where a model leaves little more than noise, and takes away nearly all that the plain one leaves."""
    return each.ratio < HARDLY * each.floor and each.excess < _MOST_OF_IT * plain.excess
