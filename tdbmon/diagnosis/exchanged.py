"""Another cause in the place of one that held for a while.

At the first contacts a loose, a hardening and an anisotropic support look alike, and small differences decide which of them
is fitted first.  A wrong one fails at later contacts.
"""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.diagnosis.attempt import at_usual_size, followed_on
from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.suspects import Suspect

_FOLLOWED = 4  # of the best, followed on to the horizon at which the cause fails


def exchanged(
    fallen: Contender, failing: Contender, suspects: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return the best of the contender and the same with another last cause, started in the fall at its usual size.

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
    *kept, _ = failing.known
    begun = at_usual_size(fallen, kept, others, horizons)
    on = [h for h in horizons if fallen.problem.stages.touched < h <= failing.horizon]
    return min([failing, *followed_on(begun[:_FOLLOWED], on, most=failing.misfit)], key=lambda each: each.bic)
