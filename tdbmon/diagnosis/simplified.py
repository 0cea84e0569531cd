"""Removal of causes that a model does not need."""

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

HOPELESS = 2.0  # misfit ratio above which a model is hopeless beside one with half of it
_MOST_OF_IT = 0.1  # share of the plain model's excess left by a model that explains nearly all of it


def simplified(plain: Contender, field: list[Contender]) -> tuple[Contender, list[Contender]]:
    """Return the plain model and the others, those with needless causes replaced by simpler ones."""
    while field:
        best = min(field, key=lambda each: each.bic)
        simpler = []
        for freed in (*without_each(best, best.horizon), *at_both_ends(best)):
            # a rough fit that is far off needs no better one: the cause is needed
            near = settled(freed, best.horizon, SLOPES) if freed.ratio < 2 * HOPELESS * best.ratio else freed
            # a model that leaves no more with one cause less is better, whether it fails or not
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
    """Return the contender with one cause at both ends in the place of two that differ in their end only, not yet fitted.

    A search that adds one cause at a time finds an effect at both ends as two.  The start point is the mean of both, with the
    angle of the first.
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
    """True if the cause that `best` has and `near` lacks only fits what inexact laws leave.

    So if it is drop-specific, and `near` with its other causes hardly fails: such a cause fits much that is not there.
    """
    gone = [cause for cause in best.causes if cause.name not in near.effects]
    return bool(near.causes and gone) and all(cause.drop_specific for cause in gone) and hardly_fails(near, plain)


def hardly_fails(each: Contender, plain: Contender) -> bool:
    """True if a model leaves little more than noise, and takes away nearly all of the plain model's excess."""
    return each.ratio < HARDLY * each.floor and each.excess < _MOST_OF_IT * plain.excess
