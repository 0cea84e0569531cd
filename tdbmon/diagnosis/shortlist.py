"""Which suspects are fitted in addition to a model's causes, and how thoroughly: by their scores and their rough fits."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tdbmon.diagnosis.contender import Contender, negligible
from tdbmon.diagnosis.score import Score, scores
from tdbmon.diagnosis.suspects import Suspect

_SAME_NAME = 2  # words or orders of one effect at one place, fitted roughly
_ADMITTED = 8  # best rough fits that get a Jacobian of their own
_SAME_KIND = 3  # of one effect among them
WEAK = 2  # beside a model that holds: candidates kept of the fits with a Jacobian of their own, and of the scores
# gain beyond the BIC's price of its parameters from which a suspect is fitted from the fall on: with nothing hidden the best
# score was lower in five of eight synthetic cases
_PROMISING = 150.0
SURE = 20.0  # least gain beyond the BIC's price of its parameters
_PROMISE = 0.2  # least gain of a further cause, share of the leader's excess
_ASKED_ANYWAY = 3  # names with the best scores, fitted if they gain anything beyond that price


def promising(best: Contender, asked: Sequence[Score], share: float = 0.0) -> list[Score]:
    """Return the highest scores of suspects of different names, beyond the BIC's price of their parameters.

    Each must also promise a share of the best contender's excess.
    """
    price = math.log(best.fit.count)
    of_each_name: dict[str, Score] = {}
    for score in sorted(asked, key=lambda score: score.beyond(price), reverse=True):
        of_each_name.setdefault(score.suspect.name, score)
    return [
        score
        for score in of_each_name.values()
        if score.beyond(price) > max(_PROMISING, _of_excess(share, best, score))
    ][:WEAK]


def _of_excess(share: float, best: Contender, score: Score) -> float:
    """Return a share of the best contender's excess in the units of its scores."""
    return share * score.total * best.excess / best.misfit


def worth_fitting(
    best: Contender, horizon: float, suspects: Sequence[Suspect], field: Sequence[Contender], thorough: bool
) -> list[Score]:
    """Return the scores of the suspects to fit roughly: all in a thorough search beside the plain model, else the promising ones.

    Two drop-specific causes never stand together: they would fit what is in no catalogue.
    """
    known = {each.effects for each in field if each.horizon == horizon}
    open_to = [
        s
        for s in suspects
        if s.name not in best.effects
        and best.effects | {s.name} not in known
        and not (s.drop_specific and best.drop_specific)
    ]
    price = math.log(best.fit.count)
    found: list[Score] = []
    names: dict[str, int] = {}
    for score in scores(best.problem, best.fit, horizon, open_to):
        name = score.suspect.name
        names[name] = names.get(name, 0) + 1
        worth = score.beyond(price)
        least = _of_excess(_PROMISE, best, score) if best.causes else -math.inf if thorough else SURE
        # a score is linear, and a model that fails is far from its minimum
        first = len(names) <= _ASKED_ANYWAY and worth > 0
        if (
            names[name] <= _SAME_NAME
            and (worth > least or first)
            and (thorough or not negligible(score.suspect, score.start.shared))
        ):
            found.append(score)
    return found


def admitted(rough: Sequence[Contender], promised: Sequence[Suspect]) -> tuple[list[Contender], list[Contender]]:
    """Return the rough fits that get a Jacobian of their own, and those that get one only if none of the former explains.

    The former: the best fits, the suspects with the best scores, since a rough fit may fail where the score is right, and balls,
    whose number is not yet known.  The latter: further contact causes, whose rough fits seldom end near their minimum; after the
    first contacts they take too long.
    """
    likely: list[Contender] = []
    others: list[Contender] = []
    kinds: dict[tuple[str, bool], int] = {}
    for place, each in enumerate(rough):
        new = each.causes[-1]
        kind = new.declared.identifier, new.turning
        if new in promised or new.counted is not None:
            likely.append(each)
            continue
        kinds[kind] = kinds.get(kind, 0) + 1
        if kinds[kind] <= _SAME_KIND and place < _ADMITTED:
            likely.append(each)
        elif kinds[kind] <= _SAME_KIND and new.in_contacts and not new.turning:
            others.append(each)
    return likely, others


def siblings_first(ranked: Sequence[Contender]) -> list[Contender]:
    """Move the first contender with the leader's effect at both ends instead of one, or the reverse, up to second place.

    Rough fits hardly tell whether an effect acts at one end or at both alike; and with a second cause, which cancels the effect
    at the wrong end, the wrong model fits as well as the right one.
    """
    for place, each in enumerate(ranked[1:], start=1):
        mine, best = each.causes[-1], ranked[0].causes[-1]
        if mine.declared is best.declared and "both" in (mine.where, best.where):
            return [ranked[0], each, *ranked[1:place], *ranked[place + 1 :]]
    return list(ranked)
