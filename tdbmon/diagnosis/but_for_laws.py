"""A model with a cause in contacts less, which explains the drops but for what inexact laws leave.

Of two causes in contacts the one that was found first may be wrong and yet fit what the law of the other leaves.  Had the other
been first, nothing more would have been sought beside it: while paths had hardly parted it left noise alone, and further on it
leaves little of what it takes away.
"""

from __future__ import annotations

from collections.abc import Sequence

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import all_from_the_fall, followed_on
from tdbmon.diagnosis.contender import FEW_SLOPES, SOUND_S, Contender, settled
from tdbmon.diagnosis.met_alike import at_other_sizes


def but_for_laws(
    fallen: Contender, both: Contender, freed: Contender, plain: Contender, horizons: Sequence[float]
) -> Contender | None:
    """Return a model led from the fall on where it explains the drops but for inexact laws; None where it does not.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    both : Contender
        With causes in contacts, which leaves noise alone.
    freed : Contender
        The same without one of them.
    plain : Contender
        To the horizon of both.
    horizons : sequence of float
        All; fits go along those up to the horizon of both.
    """
    gone = [cause for cause in both.causes if cause not in freed.causes]
    if not freed.in_contacts or not all(cause.in_contacts for cause in gone) or both.horizon <= SOUND_S:
        return None
    try:
        sound = _sound(fallen, freed, horizons)
        if sound is None:
            return None
        found = followed_on([sound], [h for h in horizons if SOUND_S < h <= both.horizon])
    except InputError:
        return None
    return next((each for each in found if not each.fails_beside(plain)), None)


def _sound(fallen: Contender, freed: Contender, horizons: Sequence[float]) -> Contender | None:
    """Return the model as far as paths have hardly parted, if it leaves noise alone there."""
    found = all_from_the_fall(fallen, [settled(freed, SOUND_S, FEW_SLOPES)], horizons)
    for each in found:
        best = each
        for cause in each.causes if each.fails else ():
            if cause.many_valued:
                best = at_other_sizes(fallen, best, cause, horizons)
        if not best.fails:
            return best
    return None
