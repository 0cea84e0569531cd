"""How probable each of the models is that competed, by the criterion and by what it takes away on a drop held out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tdbmon.diagnosis.contender import EXPLAINED, NEARLY, Contender, plain_of
from tdbmon.diagnosis.held_out import HeldOut, Judge
from tdbmon.diagnosis.twins import sensors_alike

TEMPERATURE = 15.0  # by which differences of the criterion count less than for noise alone: models are never exact
# the same between two causes that act on the sensors of one end: an angle and a leak differ by the square of their size only,
# and of four that led over the other by 29 to 330 one was right
_TEMPERATURE_OF_SENSORS = 150.0
# weight of a cause in no catalogue beside the best model's 1, where that one leaves as much as an explanation may; and the power
# of what is left with which it changes: a fifth more makes four times as much
_OUTSIDE, _STEEP = 0.05, 8
_DOUBT = 0.1  # of what the best model leaves beyond noise, by which they count less still
GAINED = 0.8  # on a drop held out
# of causes named with more than that, on synthetic drops of another program, 154 of 163 were there by earlier methods, and
# 51 of 52 by the present one: one more of each kind makes 0.037
WRONG = 0.04
WRONG_OF_LITTLE = 0.5  # with less, 8 of 16
# that waves, lobes or a ball are at a bearing where one of them held for a while and then failed: in three of five blind cases
ONE_OF_THREE = 0.6
CERTAIN = 0.9 * (1 - WRONG)  # probability from which on a cause is named


def explains(best: Contender, plain: Contender) -> bool:
    """True where a model leaves noise alone, or so little of what its contacts take away as their law may be inexact."""
    return best.ratio <= EXPLAINED or (best.ratio <= NEARLY and best.leaves_little(plain))


def probabilities_of(contenders: Sequence[Contender], lead: float) -> tuple[float, ...]:
    """Return the probability of each contender; what is missing to 1 is for causes outside the catalogue.

    Parameters
    ----------
    contenders : sequence of Contender
        The plain model is among them.
    lead : float
        Of the plain model in the criterion.
    """
    criteria = [each.bic - (0.0 if each.causes else lead) for each in contenders]
    least = min(criteria)
    best = contenders[criteria.index(least)]
    # what even the best model leaves says how little a difference means
    temperature = TEMPERATURE + _DOUBT * best.excess
    soft = max(temperature, _TEMPERATURE_OF_SENSORS)
    weights = [
        math.exp(-(c - least) / (2 * (soft if sensors_alike(each, best) else temperature)))
        for c, each in zip(criteria, contenders, strict=True)
    ]
    # a model that leaves much is likely to lack something that is in no catalogue
    outside = min(best.ratio / EXPLAINED, 1.0 if explains(best, plain_of(contenders)) else math.inf) ** _STEEP
    total = sum(weights) + _OUTSIDE * outside
    return tuple((1 - WRONG) * w / total for w in weights)


def little_gained(proof: HeldOut | None) -> str | None:
    """Return why a named cause is likelier not to be there, by what it takes away on a drop held out, or None."""
    if proof is None:
        return None
    if proof.gain is None:
        little, told = (
            proof.clear_in_each or proof.judge is Judge.REST,
            "it shows in all that is known of the drops held out, not to be seen in readings",
        )
    else:
        little, told = proof.gain < GAINED, f"the gain on the drop held out is below {GAINED:g}"
    return f"{100 * WRONG_OF_LITTLE:.0f} % are left to what is not listed, since {told}" if little else None


def discounted(probabilities: tuple[float, ...], proof: HeldOut | None) -> tuple[float, ...]:
    """Return the probabilities of accused models that gain little on a drop held out: something else may be in their place."""
    if little_gained(proof) is None:
        return probabilities
    return tuple(each * (1 - WRONG_OF_LITTLE) / (1 - WRONG) for each in probabilities)
