"""Causes at the sensors that look alike: a probe that stands at another angle, one into which the other leaks.

They differ by little more than the square of their size, so each is fitted in the place of the other before one is named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import FEW_SLOPES, Contender, settled, with_cause, without_cause
from tdbmon.diagnosis.score import scores
from tdbmon.diagnosis.suspects import Suspect
from tdbmon.identify.free_effect import acts_on_sensors

_LIKE = 0.9  # of what a cause promises, that another must promise in its place


def twins(best: Contender, suspects: Sequence[Suspect]) -> list[Contender]:
    """Return the best model with another cause in the place of one at the sensors, where that promises about as much.

    Parameters
    ----------
    best : Contender
    suspects : sequence of Suspect
    """
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
