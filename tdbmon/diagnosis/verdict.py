"""What the competition of models means: none, named, ambiguous or unknown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from tdbmon.diagnosis.contender import EXPLAINED, FOLLOWED_S, NEARLY, PLAIN_LEAD, Contender
from tdbmon.diagnosis.held_out import HeldOut, Judge, to_be_seen
from tdbmon.diagnosis.suspects import Suspect, met_alike
from tdbmon.diagnosis.twins import sensors_alike
from tdbmon.estimate import Estimate
from tdbmon.identify.free_effect import acts_on_sensors

TEMPERATURE = 15.0  # by which differences of the criterion count less than for noise alone: models are never exact
# the same between two causes that act on the sensors of one end: an angle and a leak differ by the square of their size only,
# and of four that led over the other by 29 to 330 one was right
_TEMPERATURE_OF_SENSORS = 150.0
_DOUBT = 0.1  # of what the best model leaves beyond noise, by which they count less still
_MOST = 0.5  # of what the plain model leaves beyond noise
_HALF = 0.5  # as likely as the best, beside which a plain model that explains the drops accuses nobody
GAINED = 0.8  # on a drop held out
# of causes named with more than that, on synthetic drops of another program, 154 of 163 were there by earlier methods, and
# 51 of 52 by the present one: one more of each kind makes 0.037
WRONG = 0.04
WRONG_OF_LITTLE = 0.5  # with less, 8 of 16
# that waves, lobes or a ball are at a bearing where one of them held for a while and then failed: in three of five blind cases
ONE_OF_THREE = 0.6
CERTAIN = 0.9 * (1 - WRONG)  # probability from which on a cause is named


class Kind(StrEnum):
    """The four verdicts."""

    NONE = "none"
    NAMED = "named"
    AMBIGUOUS = "ambiguous"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class Alike:
    """Causes that may be there in the place of an accused model's, and were not fitted as far, with their probability."""

    causes: tuple[Suspect, ...]
    probability: float

    @property
    def words(self) -> str:
        """Its causes and their places in words."""
        return " and ".join(cause.words for cause in self.causes)


@dataclass(frozen=True, eq=False)
class Verdict:
    """The outcome.

    Attributes
    ----------
    kind : Kind
    accused : tuple of Contender
        The named model, and those of the same causes with other words or orders that are nearly as likely; all that
        cannot be told apart; the likeliest first, none for none and unknown.
    probabilities : tuple of float
        Of every contender, in their order; what is missing to 1 is for causes outside the catalogue.
    why : str
        In one sentence.
    alike : tuple of Alike
        What looks like the accused model as far as it held; nothing where it holds to the end.
    doubt : str or None
        Why so much of the probability is left to causes that are not listed; None where it is not.
    """

    kind: Kind
    accused: tuple[Contender, ...]
    probabilities: tuple[float, ...]
    why: str
    alike: tuple[Alike, ...] = ()
    doubt: str | None = None


def verdict(
    contenders: Sequence[Contender],
    proof: HeldOut | None,
    lead: float = PLAIN_LEAD,
    suspects: Sequence[Suspect] = (),
) -> Verdict:
    """Judge.

    Parameters
    ----------
    contenders : sequence of Contender
        The best first; the plain model is among them.
    proof : HeldOut or None
        Of the best one with a cause against the plain model; None where no drop could be held out.
    lead : float
        Of the plain model in the criterion: less where few suspects were asked.
    suspects : sequence of Suspect
        All that were asked.
    """
    plain = next(each for each in contenders if not each.causes)
    probabilities = _probabilities(contenders, lead)
    best = max(zip(probabilities, contenders, strict=True), key=lambda each: each[0])[1]
    if not best.causes and best.ratio <= EXPLAINED:
        return Verdict(
            Kind.NONE, (), probabilities, f"the plain model leaves {best.times_noise} times what noise would"
        )
    if not _explains(best, plain):
        left = f"{best.ratio:.1f} times what noise would in the first {best.horizon * 1e3:g} ms"
        model = f"the model with {best.words}" if best.causes else "the plain model"
        why = f"the best, {model}, still leaves {left}"
        if best.horizon > FOLLOWED_S:
            why += f", most of it later than {FOLLOWED_S * 1e3:g} ms"
        return Verdict(Kind.UNKNOWN, (), probabilities, why)
    if plain.ratio <= EXPLAINED and best.fails and best.excess > _MOST * plain.excess:
        why = f"{best.words} fits better, but leaves most of the little that the plain model leaves beyond noise"
        return Verdict(Kind.NONE, (), probabilities, why)
    if proof is not None and not _proved(best, plain, proof):
        gains = "too little" if proof.holds else "nothing"
        why = f"{best.words} fits better, but on {proof.named}, it gains {gains}"
        return Verdict(Kind.NONE if plain.ratio <= EXPLAINED else Kind.UNKNOWN, (), probabilities, why)
    if best.failed_s and best.much_fitting is not None:
        return _one_of_a_kind(best, best.much_fitting, contenders, probabilities, suspects)
    # what acts in contacts is of many kinds, which look alike while they are small, and like paths that part by chance
    if proof is not None and not plain.fails and best.in_contacts and not (proof.seen or proof.clear_in_each):
        why = f"the plain model leaves noise alone; {best.words} fits a little better, too little to be proved on {proof.drop}"
        return Verdict(Kind.NONE, (), probabilities, why)
    without, likeliest = probabilities[list(contenders).index(plain)], max(probabilities)
    if plain.ratio <= EXPLAINED and without > _HALF * likeliest:
        why = f"the plain model explains the drops nearly as well as {best.words}"
        return Verdict(Kind.NONE, (), probabilities, why)
    total = 0.0
    accused: list[Contender] = []
    for probability, each in sorted(zip(probabilities, contenders, strict=True), key=lambda pair: -pair[0]):
        accused.append(each)
        total += probability
        if total >= CERTAIN:
            break
    guilty = tuple(each for each in accused if each.causes)
    if len({each.effects for each in accused}) == 1:
        why = (
            f"{best.words} leaves {best.times_noise} times what noise would, the plain model {plain.times_noise} times"
        )
        return Verdict(Kind.NAMED, guilty, _discounted(probabilities, proof), why, doubt=little_gained(proof))
    why = (
        " or ".join({each.effects: each.words for each in accused}.values()) + " explain the drops almost equally well"
    )
    return Verdict(Kind.AMBIGUOUS, guilty, _discounted(probabilities, proof), why, doubt=little_gained(proof))


def _one_of_a_kind(
    best: Contender,
    cause: Suspect,
    contenders: Sequence[Contender],
    probabilities: tuple[float, ...],
    suspects: Sequence[Suspect],
) -> Verdict:
    """Return the verdict where waves, lobes or a ball hold for a while: there the others of the bearing look alike."""
    others = {
        each.declared: each for each in suspects if each.declared is not cause.declared and met_alike(each, cause)
    }
    share = ONE_OF_THREE / (1 + len(others))
    alike = tuple(
        Alike(tuple(other if each is cause else each for each in best.causes), share) for other in others.values()
    )
    accused = tuple(each for each in contenders if each.effects == best.effects)
    total = sum(p for p, each in zip(probabilities, contenders, strict=True) if each in accused)
    why = (
        f"{best.words} explains the first {best.horizon * 1e3:g} ms, but not the first {best.failed_s * 1e3:g} ms; so far"
        " waves, lobes and a ball look alike"
    )
    return Verdict(Kind.AMBIGUOUS, accused, tuple(share / total * each for each in probabilities), why, alike)


def doubted(
    judged: Verdict, plain: Contender, sizes: Mapping[str, Mapping[str, Estimate]], proof: HeldOut | None
) -> Verdict:
    """Return the verdict, or none where no size of a named cause is clear of nothing and the plain model explains the drops.

    A cause that is much better on a drop held out is there, however badly its size is known; and so is one that is clearly
    better there and explains a drop that the plain model does not: where that one shows it alone, the others know no size.
    But not one with angles or a number of its own in every drop, which even a drop held out lets it fit.

    Parameters
    ----------
    judged : Verdict
    plain : Contender
    sizes : mapping
        Of each cause of the named model, its parameters by name.
    proof : HeldOut or None
    """
    if judged.kind is not Kind.NAMED or plain.ratio > EXPLAINED:
        return judged
    named = judged.accused[0]
    alone = max(plain.ratio_of_drops) > EXPLAINED >= max(named.ratio_of_drops)
    if proof is not None and (proof.seen or (alone and proof.holds and proof.clear)) and not named.of_each_drop:
        return judged
    for cause in named.causes:
        if not any(_clear(sizes[cause.name].get(size.name), size.off) for size, _ in cause.sizes):
            why = f"{cause.words} fits better, but its size may as well be none"
            return Verdict(Kind.NONE, (), judged.probabilities, why)
    return judged


def outside(judged: Verdict, why: str) -> Verdict:
    """Return the verdict that something acts which is in no catalogue, seen in what no model is fitted to."""
    return Verdict(Kind.UNKNOWN, (), tuple(WRONG * each for each in judged.probabilities), why)


def _clear(size: Estimate | None, off: float | str) -> bool:
    """True where the interval of a size does not hold the value at which the effect is off."""
    if size is None or size.low is None or size.high is None or isinstance(off, str):
        return size is not None
    return not size.low <= off <= size.high


def _proved(best: Contender, plain: Contender, proof: HeldOut) -> bool:
    """True where a model does better on a drop held out: to be seen in readings, if it has angles of its own in every drop.

    To be seen, too, if a cause acts on the shaft and the plain model explains the drops, where readings can tell: with nothing
    hidden some such cause made up for laws that are a little off, and took away 0.23 to 0.37 of what was left there in four
    fits to synthetic drops.  Sensors have exact laws.
    """
    if to_be_seen(plain, best):
        return proof.seen
    on_shaft = not all(acts_on_sensors(cause.declared) for cause in best.causes)
    if on_shaft and plain.ratio <= EXPLAINED and proof.gain is not None:
        return proof.seen
    return proof.holds


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


def _discounted(probabilities: tuple[float, ...], proof: HeldOut | None) -> tuple[float, ...]:
    """Return the probabilities of accused models that gain little on a drop held out: something else may be in their place."""
    if little_gained(proof) is None:
        return probabilities
    return tuple(each * (1 - WRONG_OF_LITTLE) / (1 - WRONG) for each in probabilities)


def _explains(best: Contender, plain: Contender) -> bool:
    """True where a model leaves noise alone, or so little of what its contacts take away as their law may be inexact."""
    return best.ratio <= EXPLAINED or (best.ratio <= NEARLY and best.leaves_little(plain))


def _probabilities(contenders: Sequence[Contender], lead: float) -> tuple[float, ...]:
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
    plain = next(each for each in contenders if not each.causes)
    outside = min(best.ratio / EXPLAINED, 1.0 if _explains(best, plain) else math.inf) ** 8
    total = sum(weights) + outside * 0.05
    return tuple((1 - WRONG) * w / total for w in weights)
