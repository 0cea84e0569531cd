"""To which models a further cause is added: not to the leader alone while its causes or their places may be wrong."""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.diagnosis.contender import HARDLY, Contender

# share of the plain model's excess that a rival must take away for a further cause to be sought beside it
RIVAL_TAKES = 0.25
_BESIDE = 1.3  # greatest excess of a model with the leader's effects at other places, in units of the leader's


def only_parts(best: Contender) -> bool:
    """True for a plain model that held to the last common horizon and now leaves little more than noise: paths diverge."""
    return not best.causes and best.horizon > best.problem.stages.followed and best.ratio < HARDLY * best.floor


def extended_by(best: Contender, field: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return the contenders at this horizon that lack one of the leader's causes; none once paths have diverged."""
    if horizon > best.problem.stages.sound:
        return []
    return [
        each
        for each in field
        if each.horizon == horizon and len(each.causes) == len(best.causes) - 1 and each.effects < best.effects
    ]


def elsewhere(best: Contender, horizon: float, field: Sequence[Contender]) -> list[Contender]:
    """Return the best contender with the leader's effects at other places, if its excess comes near the leader's.

    While the place is undecided, a further cause may show only beside the cause at the right place.
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
    """Return the leader's rivals at this horizon with as many causes, which are other effects.

    A rival that takes away next to nothing of the plain model's excess is left out: it stands in for no other cause.
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
