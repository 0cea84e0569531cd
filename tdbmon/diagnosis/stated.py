"""Whether the excess of the best model is due to a cause, or to values that the machine file states without tolerance.

A machine file gives a tolerance to values that are to be calibrated.  What it states without one (stiffness and exponent of the
contact, dependence of friction on load, stiffness of the balls, masses, elastic modulus) is never exact either.  Where the best
model fails and these values, moved within their usual uncertainty, take away half of its excess, they stay free in all models.
Where the plain model explains the drops, a cause must take away more than they do.
"""

from __future__ import annotations

from collections.abc import Sequence

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import all_from_the_fall
from tdbmon.diagnosis.contender import EXPLAINED, FEW_SLOPES, SLOPES, Contender, eased, settled
from tdbmon.identify.stated_values import WORTH, fitted_with_stated_values, has_stated_values

_HOPELESS = 2.0  # times the lowest misfit ratio


def explained_by_stated_values(best: Contender) -> bool:
    """True if freeing the stated values, fitted from the model's present values, takes away half of its excess."""
    freed = fitted_with_stated_values(best.problem, best.fit, best.horizon)
    return freed is not None and explained(best, freed[1].misfit)


def explained(before: Contender, freed: float) -> bool:
    """True if the misfit with the stated values free, `freed`, is lower by half of the excess before."""
    return before.misfit - freed > WORTH * before.excess


def plain_beside(plain: Contender, best: Contender) -> Contender:
    """Return the plain model to compare with the leader: with the stated values free if that leaves less than the leader.

    Only where a cause leads and the plain model explains the drops.  Causes of sensors alone are exempt: no stated value acts
    like them.
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
    """Return the plain model fitted to the fall, and the contenders refitted to their horizons, with the stated values free.

    Contenders are fitted from the fall on, hopeless ones from their present values.  None if one cannot be simulated.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    contenders : sequence of Contender
    horizons : sequence of float
        All, s; those up to each contender's own are used.
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
        refitted = iter(found)
        return start, [
            settled(each, each.horizon, FEW_SLOPES) if hopeless else next(refitted)
            for each, hopeless in zip(free, lost, strict=True)
        ]
    except InputError:
        return None
