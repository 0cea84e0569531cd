"""Another cause in the place of one that held for a while.

At the first contacts a support that loosens, one that hardens and one that is softer one way look alike; which of them is
fitted first can hang on little.  The one that is not there fails as contacts go on.
"""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.diagnosis.attempt import at_usual_size, followed_on
from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.suspects import Suspect

_SEATED = 4  # of the best, that go on to where the cause fails


def exchanged(
    fallen: Contender, failing: Contender, suspects: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best with another cause in the place of its last one, begun in the fall at its usual size.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    failing : Contender
        Its last cause acts in contacts.
    suspects : sequence of Suspect
    horizons : sequence of float
        s; those up to the contender's own are used.
    """
    others = [each for each in suspects if each.name not in failing.effects]
    *stay, _ = failing.known
    begun = at_usual_size(fallen, stay, others, horizons)
    on = [h for h in horizons if fallen.problem.stages.touched < h <= failing.horizon]
    return min([failing, *followed_on(begun[:_SEATED], on, most=failing.misfit)], key=lambda each: each.bic)
