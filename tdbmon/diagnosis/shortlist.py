"""Which suspects are fitted beside a model, and how carefully: by their scores, and by how their rough fits come out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tdbmon.diagnosis.contender import Contender, negligible
from tdbmon.diagnosis.score import Score, scores
from tdbmon.diagnosis.suspects import Suspect

_SAME_NAME = 2  # of one effect at one place with other words or orders, that are fitted roughly
_ADMITTED = 8  # of those fitted roughly, fitted with their own slopes
_SAME_KIND = 3  # of one effect among them
WEAK = 2  # beside a model that leaves noise alone: of those fitted with their own slopes, and of the best scores
# sum of squares beyond the price of its parameters, from which on a score is worth fits from the fall on: with nothing hidden
# the best promised less than that in five synthetic cases of eight
_PROMISING = 150.0
SURE = 20.0  # sum of squares that a suspect must promise beyond the price of its parameters
_PROMISE = 0.2  # of what is left beyond noise, that a further cause must promise
_ASKED_ANYWAY = 3  # of the best scores, whatever they promise


def promising(best: Contender, asked: Sequence[Score], share: float = 0.0) -> list[Score]:
    """Return the scores, of suspects of different names, that promise most beyond the price of their parameters.

    They must promise a share of what the best contender leaves beyond noise, too.
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
    """Return a share of what the best contender leaves beyond noise, in the units of its scores."""
    return share * score.total * best.excess / best.misfit


def worth_fitting(
    best: Contender, horizon: float, suspects: Sequence[Suspect], field: Sequence[Contender], thorough: bool
) -> list[Score]:
    """Return the suspects to fit roughly: all in a thorough search beside the plain model, else those that promise a gain.

    Two that have angles or a number of their own in every drop never stand together: they would fit what is in no catalogue.
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
        # a score follows straight lines, and a fit that fails is far off
        first = len(names) <= _ASKED_ANYWAY and worth > 0
        if (
            names[name] <= _SAME_NAME
            and (worth > least or first)
            and (thorough or not negligible(score.suspect, score.start.shared))
        ):
            found.append(score)
    return found


def admitted(rough: Sequence[Contender], promised: Sequence[Suspect]) -> tuple[list[Contender], list[Contender]]:
    """Return who of those fitted roughly, the best first, gets slopes of his own, and who gets them if nobody explains.

    Those of the best scores do: a rough fit may fail where the score is right.  What acts in contacts is seldom near its
    minimum yet, nor is it known which ball differs; later on it takes too long.
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
    """Return contenders, the best first, with that next to it which has its cause at one end if it has it at both, or so.

    Where an effect acts at both ends alike or at one, rough fits hardly tell; and with a second cause, which takes away again
    what is too much at the other end, the wrong one is as good as the right one.
    """
    for place, each in enumerate(ranked[1:], start=1):
        mine, best = each.causes[-1], ranked[0].causes[-1]
        if mine.declared is best.declared and "both" in (mine.where, best.where):
            return [ranked[0], each, *ranked[1:place], *ranked[place + 1 :]]
    return list(ranked)
