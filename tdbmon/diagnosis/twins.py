"""Causes at the sensors that look alike: a probe that stands at another angle, one into which the other leaks.

They differ by little more than the square of their size, so each is fitted in the place of the other before one is named,
with every drop's path sought anew: a path that is lost costs more than they differ by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import FEW_SLOPES, Contender, settled, with_cause, without_cause
from tdbmon.diagnosis.score import scores
from tdbmon.diagnosis.suspects import Suspect
from tdbmon.identify.follow import CONTACT_S
from tdbmon.identify.free_effect import acts_on_sensors
from tdbmon.identify.own_paths import better_paths

_LIKE = 0.9  # of what a cause promises, that another must promise in its place


def with_twins(field: Sequence[Contender], best: Contender, suspects: Sequence[Suspect]) -> list[Contender]:
    """Return contenders with the twins of the best one; of the same causes the one that fits best.

    Parameters
    ----------
    field : sequence of Contender
    best : Contender
        One of them.
    suspects : sequence of Suspect
    """
    alike = _twins(best, suspects)
    if not alike:
        return list(field)
    sought = [_paths_sought(each) for each in (best, *alike)]
    found: dict[frozenset[Suspect], Contender] = {}
    for each in sorted((*field, *sought), key=lambda each: each.bic):
        found.setdefault(frozenset(each.causes), each)
    return list(found.values())


def _paths_sought(contender: Contender) -> Contender:
    problem, horizon = contender.problem, contender.horizon
    if horizon < CONTACT_S:
        return contender
    return replace(contender, fit=better_paths(problem, contender.fit, horizon, range(len(problem.drops))))


def _twins(best: Contender, suspects: Sequence[Suspect]) -> list[Contender]:
    """Return the best model with another cause in the place of one at the sensors, where that promises about as much."""
    found = []
    known = {cause.name for cause in best.causes}
    others = [each for each in suspects if acts_on_sensors(each.declared) and each.name not in known]
    for index, cause in enumerate(best.causes):
        if not acts_on_sensors(cause.declared):
            continue
        try:
            bare = without_cause(best, index)
            ranked = scores(bare.problem, bare.fit, best.horizon, [cause, *others])
            own = max(score.gain for score in ranked if score.suspect is cause)
            for score in ranked:
                if score.suspect is not cause and score.gain > _LIKE * own:
                    other = with_cause(bare, score.suspect, score.start)
                    found.append(settled(replace(other, horizon=best.horizon), best.horizon, FEW_SLOPES))
        except InputError:
            continue
    return found
