"""The verdict of a contest: none, named, ambiguous or unknown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from tdbmon.diagnosis.contender import EXPLAINED, PLAIN_LEAD, Contender, plain_of
from tdbmon.diagnosis.held_out import HeldOut, proved
from tdbmon.diagnosis.probability import (
    CERTAIN,
    ONE_OF_THREE,
    WRONG,
    discounted,
    explains,
    little_gained,
    probabilities_of,
)
from tdbmon.diagnosis.suspects import Suspect, alike_at_first_contact
from tdbmon.estimate import Estimate
from tdbmon.identify.stated_values import at_their_limits, has_stated_values

_MOST = 0.5  # share of the plain model's excess
_STRAINED = 3  # stated values at their limits from which on a model counts as bent
_HALF = 0.5  # probability of a plain model that explains the drops, relative to the best, above which no cause is named


class Kind(StrEnum):
    """The four verdicts."""

    NONE = "none"
    NAMED = "named"
    AMBIGUOUS = "ambiguous"
    UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False)
class Alike:
    """Causes that may act in the place of an accused model's but were not fitted as far, with their probability."""

    causes: tuple[Suspect, ...]
    probability: float

    @property
    def words(self) -> str:
        """Its causes and their places in words."""
        return " and ".join(cause.words for cause in self.causes)


@dataclass(frozen=True, eq=False)
class Verdict:
    """The verdict of a contest.

    Attributes
    ----------
    kind : Kind
    accused : tuple of Contender
        Named: the named model, and nearly as likely ones of the same causes with other words or orders.  Ambiguous: all
        models that cannot be told apart.  The likeliest first; empty for none and unknown.
    probabilities : tuple of float
        Of every contender, in their order; the rest to 1 is that of causes outside the catalogue.
    why : str
        Reason, in one sentence.
    alike : tuple of Alike
        Look-alikes of an accused model that held and then failed; empty if it holds to the end.
    doubt : str or None
        Why much of the probability is left to causes that are not listed; None if little is.
    or_nothing : bool
        Whether the plain model is among those that cannot be told apart.
    """

    kind: Kind
    accused: tuple[Contender, ...]
    probabilities: tuple[float, ...]
    why: str
    alike: tuple[Alike, ...] = ()
    doubt: str | None = None
    or_nothing: bool = False

    @property
    def believes(self) -> bool:
        """True where a cause is told, be it one of several that look alike."""
        return self.kind in (Kind.NAMED, Kind.AMBIGUOUS)

    def leading(self, contenders: Sequence[Contender]) -> Contender:
        """Return the first accused model, or the likeliest of the contenders (in their order) if none is accused.

        The accused comes first even if another is likelier: where look-alikes share its probability, its own share is small.
        """
        if self.accused:
            return self.accused[0]
        return max(zip(self.probabilities, contenders, strict=True), key=lambda each: each[0])[1]


def verdict(
    contenders: Sequence[Contender],
    proof: HeldOut | None,
    lead: float = PLAIN_LEAD,
    suspects: Sequence[Suspect] = (),
) -> Verdict:
    """Return the verdict of a contest.

    Parameters
    ----------
    contenders : sequence of Contender
        The best first; the plain model is among them.
    proof : HeldOut or None
        Of the best model with a cause against the plain model; None if no drop could be held out.
    lead : float
        BIC lead of the plain model: less where few suspects were tried.
    suspects : sequence of Suspect
        All that were tried.
    """
    likely = probabilities_of(contenders, lead)
    best = max(zip(likely, contenders, strict=True), key=lambda each: each[0])[1]
    case = _Case(tuple(contenders), likely, plain_of(contenders), best, proof, tuple(suspects))
    return next(found for rule in _RULES if (found := rule(case)) is not None)


@dataclass(frozen=True, eq=False)
class _Case:
    """The arguments of `verdict`, the contenders' probabilities and the likeliest of them."""

    contenders: tuple[Contender, ...]
    probabilities: tuple[float, ...]
    plain: Contender
    best: Contender
    proof: HeldOut | None
    suspects: tuple[Suspect, ...]

    @property
    def plain_explains(self) -> bool:
        """True if the plain model explains the drops."""
        return self.plain.ratio <= EXPLAINED

    @property
    def ranked(self) -> list[tuple[float, Contender]]:
        """The contenders with their probabilities, the likeliest first."""
        return sorted(zip(self.probabilities, self.contenders, strict=True), key=lambda pair: -pair[0])

    def nobody(self, kind: Kind, why: str) -> Verdict:
        """Return a verdict that accuses no model."""
        return Verdict(kind, (), self.probabilities, why)


def _nothing_is_missing(case: _Case) -> Verdict | None:
    if case.best.causes or not case.plain_explains:
        return None
    why = f"the misfit of the plain model is {case.best.times_noise} times that of noise alone"
    rival = next((each for each in case.contenders if each.causes), None)
    if rival is not None and has_stated_values(case.best.problem) and not has_stated_values(rival.problem):
        why += (
            " if values that the machine file states without tolerance are fitted too; if not, the misfit with"
            f" {rival.words} is {rival.times_noise} times that"
        )
    return case.nobody(Kind.NONE, why)


def _too_much_is_left(case: _Case) -> Verdict | None:
    best = case.best
    if explains(best, case.plain):
        return None
    left = f"{best.ratio:.1f} times that of noise alone in the first {best.horizon * 1e3:g} ms"
    model = f"the model with {best.words}" if best.causes else "the plain model"
    return case.nobody(Kind.UNKNOWN, f"the misfit of the best, {model}, is still {left}")


def _most_of_little_is_left(case: _Case) -> Verdict | None:
    best = case.best
    if not (case.plain_explains and best.fails and best.excess > _MOST * case.plain.excess):
        return None
    why = f"{best.words} fits better, but most of the plain model's small excess over noise remains"
    return case.nobody(Kind.NONE, why)


def _not_proved(case: _Case) -> Verdict | None:
    best, proof = case.best, case.proof
    if proof is None or proved(case.plain, best, proof):
        return None
    gain = "too small" if proof.holds else "none"
    why = f"{best.words} fits better, but the gain on {proof.named}, is {gain}"
    if case.plain_explains:
        return case.nobody(Kind.NONE, why)
    return outside(case.nobody(Kind.UNKNOWN, why), why)


def _one_of_a_kind(case: _Case) -> Verdict | None:
    """Ambiguous, where waves, lobes or a ball held and then failed: those of the same bearing look alike."""
    best, cause = case.best, case.best.much_fitting
    if not best.failed_s or cause is None:
        return None
    others = {
        each.declared: each
        for each in case.suspects
        if each.declared is not cause.declared and alike_at_first_contact(each, cause)
    }
    share = ONE_OF_THREE / (1 + len(others))
    alike = tuple(
        Alike(tuple(other if each is cause else each for each in best.causes), share) for other in others.values()
    )
    accused = tuple(each for each in case.contenders if each.effects == best.effects)
    total = sum(p for p, each in zip(case.probabilities, case.contenders, strict=True) if each in accused)
    shared = share * (1 + len(alike))
    probabilities = tuple(
        p * (share / total if each in accused else min(1.0, (1 - shared) / (1 - total)))
        for p, each in zip(case.probabilities, case.contenders, strict=True)
    )
    why = (
        f"{best.words} explains the first {best.horizon * 1e3:g} ms, but not the first {best.failed_s * 1e3:g} ms; in so short"
        " a time waves, lobes and a ball look alike"
    )
    return Verdict(Kind.AMBIGUOUS, accused, probabilities, why, alike)


def _looks_like_chance(case: _Case) -> Verdict | None:
    """None, where the plain model holds and a contact cause is not proved: small ones look like paths diverging by chance."""
    best, proof = case.best, case.proof
    if proof is None or case.plain.fails or not best.in_contacts or proof.shown:
        return None
    why = f"the plain model leaves only noise; {best.words} fits slightly better, too little to be proved on {proof.drop}"
    return case.nobody(Kind.NONE, why)


def _plain_as_likely(case: _Case) -> Verdict | None:
    best, plain = case.best, case.plain
    without = case.probabilities[case.contenders.index(plain)]
    if not case.plain_explains or without <= _HALF * max(case.probabilities):
        return None
    return case.nobody(Kind.NONE, f"the plain model explains the drops nearly as well as {best.words}")


def _accused(case: _Case) -> Verdict:
    """Accuse the likeliest models that together reach `CERTAIN`: named, or ambiguous if their effects differ."""
    best, total = case.best, 0.0
    accused: list[Contender] = []
    for probability, each in case.ranked:
        accused.append(each)
        total += probability
        if total >= CERTAIN:
            break
    if len({each.effects for each in accused}) == 1:
        kind = Kind.NAMED
        why = (
            f"the misfit with {best.words} is {best.times_noise} times that of noise alone, that of the plain model"
            f" {case.plain.times_noise} times"
        )
    else:
        kind = Kind.AMBIGUOUS
        words = {each.effects: each.words for each in accused}.values()
        why = " or ".join(words) + " explain the drops almost equally well"
    guilty = tuple(each for each in accused if each.causes)
    return Verdict(
        kind,
        guilty,
        discounted(case.probabilities, case.proof),
        why,
        doubt=little_gained(case.proof),
        or_nothing=len(guilty) < len(accused),
    )


# the first that returns a verdict decides
_RULES = (
    _nothing_is_missing,
    _too_much_is_left,
    _most_of_little_is_left,
    _not_proved,
    _one_of_a_kind,
    _looks_like_chance,
    _plain_as_likely,
    _accused,
)


def doubted(
    judged: Verdict, plain: Contender, sizes: Mapping[str, Mapping[str, Estimate]], proof: HeldOut | None
) -> Verdict:
    """Return the verdict, or none if the intervals of a named cause include "no effect" and the plain model explains the drops.

    A cause that gains half on a held-out drop stands, however uncertain its size; so does one that is clearly better there and
    explains a drop that the plain model does not, since its size cannot be determined from the other drops.  A drop-specific
    cause does not: it can fit even a held-out drop.

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
    alone = max(plain.fit.ratio_of_drops) > EXPLAINED >= max(named.fit.ratio_of_drops)
    if proof is not None and (proof.seen or (alone and proof.holds and proof.clear)) and not named.drop_specific:
        return judged
    for cause in named.causes:
        if not clear_of_nothing(cause, sizes[cause.name]):
            why = f"{cause.words} fits better, but its size cannot be distinguished from no effect"
            return Verdict(Kind.NONE, (), judged.probabilities, why)
    return judged


def strained(judged: Verdict) -> Verdict:
    """Return the verdict, or unknown if a named model with a contact cause has many stated values at their limits.

    Such a model is bent to compensate for what it lacks.  Causes outside contacts have no part in stated values.
    """
    if judged.kind is not Kind.NAMED or not judged.accused[0].in_contacts:
        return judged
    named = judged.accused[0]
    limits = at_their_limits(named.problem, named.fit.point)
    if len(limits) < _STRAINED:
        return judged
    return outside(
        judged,
        f"{named.words} would explain the drops, but only with {len(limits)} values of the machine file at their limits"
        f" ({', '.join(limits)}): they compensate for something that the model lacks, or the file is wrong",
    )


def outside(judged: Verdict, why: str) -> Verdict:
    """Return the verdict unknown: a cause outside the catalogue, for reasons beyond the models' fits."""
    return Verdict(Kind.UNKNOWN, (), tuple(WRONG * each for each in judged.probabilities), why)


def clear_of_nothing(cause: Suspect, sizes: Mapping[str, Estimate]) -> bool:
    """True if the interval of a size of a cause (estimates by parameter name) excludes the value at which the effect is off."""
    return any(_clear(sizes.get(size.name), size.off) for size, _ in cause.sizes)


def _clear(size: Estimate | None, off: float | str) -> bool:
    """True if the interval of a size excludes the value at which the effect is off.

    A size without interval is at the end of its range, or so large that a greater one acts the same.
    """
    if size is None or size.low is None or size.high is None or isinstance(off, str):
        return size is not None and size.value != off
    return not size.low <= off <= size.high
