"""Beside which models a further cause is sought: the best one alone is not enough while its causes or places may be wrong."""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.diagnosis.contender import HARDLY, Contender

# of what the plain model leaves beyond noise, that a rival must take away for a cause to be sought beside it
RIVAL_TAKES = 0.25
_BESIDE = 1.3  # times what the best model leaves beyond noise, that one with its causes at other places may leave


def only_parts(best: Contender) -> bool:
    """True for a plain model that leaves little more than noise after it held longer than all are followed: paths part."""
    return not best.causes and best.horizon > best.problem.stages.followed and best.ratio < HARDLY * best.floor


def extended_by(best: Contender, field: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return the contenders that lack one of the best one's causes and competed to a horizon while paths have hardly parted."""
    if horizon > best.problem.stages.sound:
        return []
    return [
        each
        for each in field
        if each.horizon == horizon and len(each.causes) == len(best.causes) - 1 and each.effects < best.effects
    ]


def elsewhere(best: Contender, horizon: float, field: Sequence[Contender]) -> list[Contender]:
    """Return the contender with the causes of the best one at other places that comes near to it, if there is one.

    While the place is not decided, what else is missing may show beside the right place only.
    """
    kinds = sorted(cause.declared.identifier for cause in best.causes)
    near = [
        each
        for each in field
        if each.horizon == horizon
        and each.name != best.name
        and sorted(cause.declared.identifier for cause in each.causes) == kinds
        and each.excess < _BESIDE * best.excess
    ]
    return [min(near, key=lambda each: each.bic)] if near else []


def others_of_the_field(
    best: Contender, plain: Contender, horizon: float, field: Sequence[Contender]
) -> list[Contender]:
    """Return the contenders with as many causes as the best one, of other kinds, that competed to a horizon with it.

    One that takes away next to nothing of what the plain model leaves is no cause in another's disguise.
    """
    asked = {best.name, *(each.name for each in elsewhere(best, horizon, field))}
    rivals = {
        each.name: each
        for each in sorted(field, key=lambda each: -each.bic)
        if best.causes
        and each.horizon == horizon
        and len(each.causes) == len(best.causes)
        and each.name not in asked
        and (plain.horizon < horizon or each.excess < (1 - RIVAL_TAKES) * plain.excess)
    }
    return sorted(rivals.values(), key=lambda each: each.bic)
