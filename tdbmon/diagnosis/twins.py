"""Look-alikes: a probe's angle, its gain and crosstalk into it; a cause at one end and the same at both.

Causes of sensors differ by little more than the square of their size.  A cause at both ends looks like one at a single end if
the values of the other end compensate for it.  So each is fitted in the place of the other before one is named, with the paths
of all drops searched for again and fits along the horizons: a lost path costs more than look-alikes differ by.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import followed_on
from tdbmon.diagnosis.contender import FEW_SLOPES, NEARLY, Contender, settled, with_cause, without_cause
from tdbmon.diagnosis.score import scores
from tdbmon.diagnosis.suspects import Suspect, alike_at_other_ends
from tdbmon.identify.own_paths import better_paths

_LIKE = 0.9  # share of a cause's score that a look-alike must reach
_NEAR_EARLY = 2.0  # greatest misfit ratio of a cause at other ends before paths diverge, in units of the best model's
_NEAR = 1.5  # the same at the last horizon, of a model that comes near the best


def twins(best: Contender, suspects: Sequence[Suspect]) -> list[Contender]:
    """Return the best model with a look-alike in the place of each of its causes, if that promises about as much.

    Parameters
    ----------
    best : Contender
    suspects : sequence of Suspect
    """
    found = []
    for index, cause in enumerate(best.causes):
        others = [each for each in suspects if each.name not in best.effects and _alike(each, cause)]
        if not others:
            continue
        try:
            bare = without_cause(best, index)
            if cause.declared.acts_on_sensors:
                found += _promising(bare, cause, others, best.horizon)
            else:
                # the values of both ends differ then, so the fit starts before paths diverge
                early = min(best.problem.stages.sound, best.horizon)
                elsewhere = followed_on([with_cause(bare, other, best.starts()[index]) for other in others], (early,))
                least = settled(best, early, 1).ratio
                found += followed_on([each for each in elsewhere if each.ratio < _NEAR_EARLY * least], (best.horizon,))
        except InputError:
            continue
    return found


def _promising(bare: Contender, cause: Suspect, others: Sequence[Suspect], horizon: float) -> list[Contender]:
    """Return the model with each look-alike of a sensor cause that promises about as much, fitted."""
    ranked = scores(bare.problem, bare.fit, horizon, [cause, *others])
    own = max((score.gain for score in ranked if score.suspect is cause), default=math.inf)
    return [
        settled(with_cause(bare, score.suspect, score.start), horizon, FEW_SLOPES)
        for score in ranked
        if score.suspect is not cause and score.gain > _LIKE * own
    ]


def _alike(one: Suspect, other: Suspect) -> bool:
    if other.declared.acts_on_sensors:
        return one.declared.acts_on_sensors
    return alike_at_other_ends(one, other)


def sensors_alike(one: Contender, other: Contender) -> bool:
    """True if two models differ in one cause each, and both of these act on sensors of the same end."""
    mine, yours = ({cause.name: cause for cause in each.causes} for each in (one, other))
    apart = [mine[name] for name in mine.keys() - yours.keys()], [yours[name] for name in yours.keys() - mine.keys()]
    if [len(each) for each in apart] != [1, 1]:
        return False
    end_of = {probe.name: probe.end for probe in one.problem.model.machine.probes}
    causes = [cause for each in apart for cause in each]
    one_end = len({end_of.get(cause.where, cause.where) for cause in causes}) == 1
    return one_end and all(cause.declared.acts_on_sensors for cause in causes)


def with_twins(
    field: Sequence[Contender], best: Contender, suspects: Sequence[Suspect], horizons: Sequence[float]
) -> list[Contender]:
    """Return the models and the best one's look-alikes after `with_paths_sought`; of models with the same causes the best.

    If a look-alike leads, it has found other values of the machine too, and its own look-alikes are fitted from there.

    Parameters
    ----------
    field : sequence of Contender
    best : Contender
        One of them.
    suspects : sequence of Suspect
    horizons : sequence of float
        All, s.
    """
    if best.ratio > NEARLY:  # no cause is named
        return _of_each(field)
    found = with_paths_sought([*field, *twins(best, suspects)], best, horizons)
    ahead = min(found, key=lambda each: each.bic)
    if ahead.causes and ahead.name != best.name:
        found = _of_each([*found, *twins(ahead, suspects)])
    return found


def _of_each(field: Sequence[Contender]) -> list[Contender]:
    """Return the best of the models with the same causes."""
    kept: dict[frozenset[Suspect], Contender] = {}
    for each in sorted(field, key=lambda each: each.bic):
        kept.setdefault(frozenset(each.causes), each)
    return list(kept.values())


def with_paths_sought(field: Sequence[Contender], best: Contender, horizons: Sequence[float]) -> list[Contender]:
    """Return the models, of those with the same causes the best, with the drops' paths searched for again.

    That is done if others come near the best, the plain model included, and for all of these, which are then fitted along the
    horizons from before paths diverge: done for one alone, it would favour that one.

    Parameters
    ----------
    field : sequence of Contender
    best : Contender
        One of them.
    horizons : sequence of float
        All, s.
    """
    kept = _of_each(field)
    near = [each for each in kept if each.horizon == best.horizon and each.ratio < _NEAR * best.ratio]
    if len(near) < 2 or best.horizon < best.problem.stages.loaded:
        return kept
    every = range(len(best.problem.drops))
    sought = [replace(each, fit=better_paths(each.problem, each.fit, each.horizon, every)) for each in near]
    again = [horizon for horizon in horizons if best.problem.stages.sound <= horizon <= best.horizon]
    led = followed_on(sought, again)
    return [*(each for each in kept if each not in near), *_of_each([*sought, *led])]
