"""Whether what the best model leaves is a cause, or only that a machine file states more exactly than anybody knows.

A machine file gives tolerances to what calibration is for.  What it states without one (stiffness and exponent of the
contact, how friction goes with the load, stiffness of the balls, masses, elastic modulus) is never exact either.
Where the best model fails and these values, moved within what is known of them, take away half of what it leaves, they stay
free in all models.  Where the plain model explains the drops, a cause must take away more than they do.
"""

from __future__ import annotations

from collections.abc import Sequence

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import all_from_the_fall
from tdbmon.diagnosis.contender import EXPLAINED, FEW_SLOPES, SLOPES, Contender, eased, settled
from tdbmon.identify.stated_values import WORTH, fitted_with_stated_values, has_stated_values

_HOPELESS = 2.0  # times what the best model leaves


def explained_by_stated_values(best: Contender) -> bool:
    """Return whether the stated values take away half of what a model leaves, fitted from where it is."""
    freed = fitted_with_stated_values(best.problem, best.fit, best.horizon)
    return freed is not None and explained(best, freed[1].misfit)


def explained(before: Contender, freed: float) -> bool:
    """Return whether a model with the stated values free, which leaves this misfit, takes away half of what it left before."""
    return before.misfit - freed > WORTH * before.excess


def plain_beside(plain: Contender, best: Contender) -> Contender:
    """Return the plain model to weigh against the best one: with the stated values free where that leaves less.

    Asked where a cause leads and the plain model leaves little more than noise.  What acts on sensors alone is nothing that
    such values do.
    """
    if (
        not best.on_shaft
        or plain.ratio > EXPLAINED
        or plain.horizon != best.horizon
        or has_stated_values(plain.problem)
    ):
        return plain
    try:
        free = settled(eased(plain), plain.horizon, SLOPES)
    except InputError:
        return plain
    return free if free.misfit < best.misfit else plain


def with_stated_values_free(
    fallen: Contender, contenders: Sequence[Contender], horizons: Sequence[float]
) -> tuple[Contender, list[Contender]] | None:
    """Return the plain model after the fall, and contenders, each fitted to where it was, with the stated values free.

    From the fall on; those that are hopeless from where they are.  None where one of them cannot be simulated so.

    Parameters
    ----------
    fallen : Contender
    contenders : sequence of Contender
    horizons : sequence of float
        All; each contender is fitted along those up to its own.
    """
    least = min(each.ratio for each in contenders)
    lost = [each.ratio > _HOPELESS * least for each in contenders]
    try:
        start = settled(eased(fallen), fallen.horizon, SLOPES)
        free = [eased(each) for each in contenders]
        found = all_from_the_fall(
            start, [each for each, hopeless in zip(free, lost, strict=True) if not hopeless], horizons
        )
        if len(found) < lost.count(False):
            return None
        led = iter(found)
        return start, [
            settled(each, each.horizon, FEW_SLOPES) if hopeless else next(led)
            for each, hopeless in zip(free, lost, strict=True)
        ]
    except InputError:
        return None
