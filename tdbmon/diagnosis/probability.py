"""Probabilities of the models of a contest, from their BIC and their gain on the held-out drop."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tdbmon.diagnosis.contender import EXPLAINED, NEARLY, Contender, plain_of
from tdbmon.diagnosis.held_out import HeldOut, Judge
from tdbmon.diagnosis.twins import sensors_alike

TEMPERATURE = 15.0  # divisor of BIC differences: 1 would hold for exact models, and none is
# the same between two causes of one end's sensors: an angle and a crosstalk differ by the square of their size only, and of
# four that led over the other by 29 to 330 one was right
_TEMPERATURE_OF_SENSORS = 150.0
# weight of a cause outside the catalogue, relative to the best model at a misfit ratio of EXPLAINED, and the power of that ratio
# with which it grows: a fifth more makes it four times as great
_OUTSIDE, _STEEP = 0.05, 8
_DOUBT = 0.1  # share of the best model's excess that is added to the divisor
GAINED = 0.8  # gain on the held-out drop from which on a named cause is trusted
# probability that a cause named with such a gain is wrong: on synthetic drops of another program 154 of 163 were right by
# earlier methods, and 51 of 52 by the present one; one more of each kind makes 0.037
WRONG = 0.04
# causes named from one drop by itself, which none held out proves, and how many of them were there, in calibration cases
NAMED_OF_ONE, RIGHT_OF_ONE = 11, 10
WRONG_OF_ONE = round(1 - (RIGHT_OF_ONE + 1) / (NAMED_OF_ONE + 2), 2)  # with one more of each kind
WRONG_OF_LITTLE = 0.5  # the same with less gain: 8 of 16 were right
# probability of waves, lobes or a ball at a bearing where one of them held and then failed: three of five blind cases
ONE_OF_THREE = 0.6
CERTAIN = 0.9 * (1 - WRONG)  # probability from which on a cause is named


def explains(best: Contender, plain: Contender) -> bool:
    """True if a model explains the drops: by its misfit ratio, or up to `NEARLY` if inexact laws account for its excess."""
    return best.ratio <= EXPLAINED or (best.ratio <= NEARLY and best.leaves_little(plain))


def probabilities_of(contenders: Sequence[Contender], lead: float) -> tuple[float, ...]:
    """Return the probability of each contender; the rest to 1 is that of causes outside the catalogue.

    Parameters
    ----------
    contenders : sequence of Contender
        The plain model is among them.
    lead : float
        BIC lead of the plain model.
    """
    criteria = [each.bic - (0.0 if each.causes else lead) for each in contenders]
    least = min(criteria)
    best = contenders[criteria.index(least)]
    # the greater the excess of even the best model, the less a difference of BIC means
    temperature = TEMPERATURE + _DOUBT * best.excess
    soft = max(temperature, _TEMPERATURE_OF_SENSORS)
    weights = [
        math.exp(-(c - least) / (2 * (soft if sensors_alike(each, best) else temperature)))
        for c, each in zip(criteria, contenders, strict=True)
    ]
    # a model that leaves much probably lacks a cause outside the catalogue
    outside = min(best.ratio / EXPLAINED, 1.0 if explains(best, plain_of(contenders)) else math.inf) ** _STEEP
    total = sum(weights) + _OUTSIDE * outside
    return tuple((1 - WRONG) * w / total for w in weights)


def little_gained(proof: HeldOut | None) -> str | None:
    """Return why a named cause is less probable, given its gain on the held-out drop; None if it gains enough."""
    if proof is None:
        return None
    if proof.gain is None:
        little, told = (
            proof.clear_in_each or proof.judge is Judge.REST,
            "it shows in all data of the held-out drops together, but not in the readings",
        )
    else:
        little, told = proof.gain < GAINED, f"the gain on the held-out drop is below {GAINED:g}"
    return f"{100 * WRONG_OF_LITTLE:.0f} % are left to causes that are not listed, since {told}" if little else None


def wrong_by(proof: HeldOut | None) -> float:
    """Return the probability that a named cause is not there, given its proof; None where no drop was held out."""
    if proof is None:
        return WRONG_OF_ONE
    return WRONG if little_gained(proof) is None else WRONG_OF_LITTLE


def discounted(probabilities: tuple[float, ...], proof: HeldOut | None) -> tuple[float, ...]:
    """Return the probabilities, lowered where the proof is missing or weak: the true cause may not be listed."""
    return tuple(each * (1 - wrong_by(proof)) / (1 - WRONG) for each in probabilities)
