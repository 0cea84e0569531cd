"""The search for a cause that would explain what the best model leaves.

Scores say where the fit of a suspect begins; fits with slopes that are known sort the suspects; slopes of their own
decide between those that come out best.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import all_from_the_fall, at_usual_size, begun, followed_on, joined, with_own_slopes
from tdbmon.diagnosis.bases import RIVAL_TAKES, elsewhere, extended_by, only_parts, others_of_the_field
from tdbmon.diagnosis.begun_anew import FirstContactFits, from_the_first_contact
from tdbmon.diagnosis.contender import (
    AHEAD,
    FEW_SLOPES,
    HARDLY,
    MOST_CAUSES,
    NEARLY,
    SLOPES,
    Contender,
    best_of_each_name,
    leader,
    replaced,
    settled,
    weighed,
    without_each,
    without_last,
)
from tdbmon.diagnosis.score import Score, scores
from tdbmon.diagnosis.shortlist import SURE, WEAK, admitted, promising, siblings_first, worth_fitting
from tdbmon.diagnosis.slows_otherwise import slows_otherwise
from tdbmon.diagnosis.suspects import Suspect
from tdbmon.identify.follow import followed
from tdbmon.identify.stages import Stages
from tdbmon.progress import Progress, silent

_PROMISED = 5  # of the best scores, fitted with their own slopes too
_SEATED = 4  # of them at most, that go on from the first search
_SEATED_LATER = 2  # the same from a later one
_CLEARLY = 0.8  # of what is left beyond noise: who takes away so much needs no rival that came out worse
# times the floor, that a plain model may leave where it holds as far as all are followed: more than its laws, paths part there
_PARTING = 1.5
_ALIKE = 2.0  # times what the best leaves at the first contact, that who looks like it may leave
# of what the best waves, lobes or ball take away at one bearing, that those at the other must take to be asked too
_WAVES_TAKE = 1 / 3
_ROUNDS = 5  # times at most that all suspects are fitted
# of them, kept for further causes: what three did not find a first cause for has none in the catalogue
_KEPT_FOR_FURTHER = 2
_FURTHER_TAKES = 0.5  # of what is left beyond noise, that a further cause must take away
_FURTHER_PROMISES = 0.25  # the same, that its score must promise where little is left
_FURTHER_TAKES_ROUGHLY = 0.3  # the same before it is fitted from the fall on


@dataclass
class Search:
    """The search for causes: what it may draw on, and how often it still may.

    Attributes
    ----------
    fallen : Contender
        The plain model, fitted to the fall before the first contact.
    suspects : sequence of Suspect
    horizons : sequence of float
        s.
    progress : callable
    rounds : int
        Times that all suspects may still be fitted.
    weak : bool
        Whether one more cause is sought beside a model with causes that leaves little; not where laws are known to be off.
    began : float
        Horizon at which causes were sought first, s.
    tried : Contender or None
        The plain model in the fall from which causes in contacts were begun.
    asked : dict
        Horizon to which causes were sought last beside each model, s, by its name.
    first_contact_fits : FirstContactFits
        Waves, lobes and balls beside the plain model where both ends have touched.
    """

    fallen: Contender
    suspects: Sequence[Suspect]
    horizons: Sequence[float]
    progress: Progress
    rounds: int = _ROUNDS
    weak: bool = True
    began: float = math.inf
    tried: Contender | None = None
    asked: dict[str, float] = field(default_factory=dict)
    first_contact_fits: FirstContactFits = field(default_factory=dict)

    @property
    def stages(self) -> Stages:
        """Up to where models are fitted and judged."""
        return self.fallen.problem.stages

    @property
    def last(self) -> float:
        """Last horizon as far as all are followed, s."""
        return max(h for h in self.horizons if h <= self.stages.followed)

    def may_ask(self, best: Contender) -> bool:
        """True where rounds are left to seek a cause beside the best contender."""
        return self.rounds > (0 if best.causes else _KEPT_FOR_FURTHER)

    def compared(self, plain: Contender, field: list[Contender], horizon: float) -> tuple[Contender, list[Contender]]:
        """Return the plain model and the others, after suspects were asked to explain what the best model leaves."""
        best = leader(plain, field, horizon)
        if best.hardly_better(plain):
            best = plain  # who explains next to nothing may stay, but what is missing is sought beside the plain model
        while self._asks_beside(best, plain, horizon):
            self.rounds -= 1
            self.began = min(self.began, horizon)
            known = [*field]
            self.progress(f"looking for what would explain the first {horizon * 1e3:g} ms")
            found = self._found_beside(best, plain, horizon, field, self._fails_plainly(best, horizon))
            if not found:
                break
            deeper = self._deeper(best, found, horizon)
            plain, field = replaced(plain, field, best, deeper)
            best = deeper
            field = field + of_size(found, best)
            for freed in without_each(min([best, *found], key=lambda each: each.bic), horizon):
                if freed.causes:
                    field.append(freed)
                elif freed.misfit < plain.misfit or plain.horizon < horizon:
                    plain = freed
            after = leader(plain, field, horizon)
            if after in (best, *known) or after.bic > best.bic - SURE or after.hardly_better(plain):
                break
            best = after
        return plain, field

    def _asks_beside(self, best: Contender, plain: Contender, horizon: float) -> bool:
        """True where a cause is sought beside the best model: where it fails, early on, or at the end for what is weak."""
        if len(best.causes) >= MOST_CAUSES or not self.may_ask(best) or only_parts(best):
            return False
        # while paths have hardly parted, what is left is a cause more often than a law that is off
        early = best.fails and horizon <= self.stages.sound
        return best.fails_beside(plain) or early or self._may_lack_what_is_weak(best, horizon)

    def _may_lack_what_is_weak(self, best: Contender, horizon: float) -> bool:
        """True as far as all are followed, for a plain model: what is weak may show later only."""
        return horizon == self.last and not best.causes and not slows_otherwise(best)

    def _fails_plainly(self, best: Contender, horizon: float) -> bool:
        """True where the search beside a model is thorough.

        A plain model that only begins to part from the drops late is in a wrong minimum more often than wrong.
        """
        parts = _PARTING if horizon >= self.last else HARDLY
        hardly = horizon >= self.stages.late and not best.causes and best.ratio < parts * best.floor
        return best.fails and not hardly

    def _deeper(self, best: Contender, found: Sequence[Contender], horizon: float) -> Contender:
        """Return the best model, or the same in a deeper minimum, which those found beside it may have led to."""
        # one that leaves noise alone was asked beside for what is weak only
        if not best.fails and min(each.bic for each in found) < best.bic - SURE:
            # who fits better may only have found the path that a plain model in a wrong minimum lost
            best = self._sought(best)
        # what is next to nothing may have led out of a hollow
        led = without_last([each for each in found if each.negligible], horizon)
        deeper = min([best, *(each for each in led if each.causes == best.causes)], key=lambda each: each.misfit)
        return deeper if deeper.misfit < best.misfit - SURE else best

    def _found_beside(
        self, best: Contender, plain: Contender, horizon: float, field: Sequence[Contender], thorough: bool
    ) -> list[Contender]:
        """Return who explains what the best contender leaves: with a cause more than it, or than another of the field.

        While paths have hardly parted, another cause in the place of the best one's last may show only now: that comes first.
        Of two causes at once the first may look like a third until both are there, so where nothing helps the best one it is
        sought beside the others that are still in the contest.
        """
        bases = [
            *(each for each in extended_by(best, [plain, *field], horizon) if self.asked.get(each.name) != horizon),
            best,
            *others_of_the_field(best, plain, horizon, field),
        ]
        at: frozenset[str] = frozenset()
        found: list[Contender] = []
        for base in bases:
            invited, wavy = self._invited(base, horizon, field, thorough)
            self.asked[base.name] = horizon
            at = wavy if base is best else at
            found = self._more_than_half(best, invited)
            holding = [each for each in found if not each.fails]
            # values make up for a small oval too, and lobes fit what these leave of it
            if thorough and holding and all(each.causes[-1].fits_much for each in holding):
                found += self._more_than_half(best, self._definite(base))
            if found and best.causes:
                return found
        if thorough and self._shows_from_the_fall(best, horizon, found):
            found += self._more_than_half(best, self._begun_in_the_fall(bases, horizon))
        # who leaves noise alone without an order or an angle in every drop to fit it with is no accident
        if at and not _explained(best, found) and all(each.fails or each.fits_much for each in found):
            found += self._more_than_half(best, self._waves(best, horizon, at))
        return found

    def _sought(self, plain: Contender) -> Contender:
        """Return the plain model, or the same followed from the fall on with rivals beside it, if that leaves less."""
        self.progress("following the plain model from several starts")
        horizons = [h for h in self.horizons if h <= plain.horizon]
        try:
            _, passed = followed(plain.problem, horizons, silent, may_widen=False)
        except InputError:
            return plain
        return min([plain, replace(plain, fit=passed[-1].fit)], key=lambda each: each.misfit)

    def _shows_from_the_fall(self, best: Contender, horizon: float, found: Sequence[Contender]) -> bool:
        """True where what acts in contacts may show if it begins in the fall, beside what the best contender has outside."""
        if best.causes:
            return horizon <= self.stages.sound
        unexplained = not _explained(best, found) and all(each.fails for each in found)
        return self.stages.touched <= horizon <= self.stages.followed and unexplained

    def _best_in_the_fall(self, bases: Sequence[Contender]) -> Contender | None:
        """Return who explains the fall best of those whose causes act outside contacts: no contact has a part in it yet."""
        outside = [each for each in bases if not each.in_contacts]
        if len(outside) < 2:
            return outside[0] if outside else None
        fall = self.horizons[0]
        return min(outside, key=lambda each: settled(each, fall, FEW_SLOPES).bic)

    def _more_than_half(self, best: Contender, found: Sequence[Contender]) -> list[Contender]:
        """Return of those found beside the best contender, or beside another, who explain enough of what it leaves."""
        least = _FURTHER_TAKES * best.excess if best.causes else -math.inf
        return [weighed(each) for each in found if best.misfit - each.misfit > least]

    def _begun_in_the_fall(self, bases: Sequence[Contender], horizon: float) -> list[Contender]:
        """Return one of some contenders with what acts in contacts, begun in the fall at its usual size and at several angles.

        Scores say little from where values have made up for it.  Beside the plain model once from one fall, since it would come
        to the same.
        """
        base = self._best_in_the_fall(bases)
        if base is None or (not base.causes and self.tried is self.fallen):
            return []
        if not base.causes:
            self.tried = self.fallen
        others = [each for each in self.suspects if not each.fits_much]
        horizons = [h for h in self.horizons if h <= horizon]
        ranked = at_usual_size(self.fallen, base.known, others, horizons)[:_SEATED_LATER]
        ranked = [each for each in ranked if each.misfit < _ALIKE * ranked[0].misfit]
        return best_of_each_name(followed_on(ranked, [h for h in horizons if h >= min(horizon, self.stages.touched)]))

    def _waves(self, best: Contender, horizon: float, at: frozenset[str]) -> list[Contender]:
        """Return the contender with waves, lobes or a ball at some bearings, begun at their usual size where contacts begin.

        Gap, clearance and cages make up for them by the time a model fails; a fit that begins there finds next to none.
        Where a model fails at the last horizon only, or one with causes hardly fails, paths part.
        """
        parts = bool(best.causes) and horizon > self.stages.sound and best.ratio < HARDLY * best.floor
        if (
            not self.stages.touched < horizon < self.stages.followed
            or parts
            or best.ratio > NEARLY
            or best.drop_specific
        ):
            return []
        others = [each for each in self.suspects if each.fits_much and each.where in at]
        return best_of_each_name(
            from_the_first_contact(
                self.fallen, best.known, others, [h for h in self.horizons if h <= horizon], self.first_contact_fits
            )
        )

    def _invited(
        self, best: Contender, horizon: float, field: Sequence[Contender], thorough: bool
    ) -> tuple[list[Contender], frozenset[str]]:
        """Return the best contender with each of the suspects that explain most, fitted, and where waves look likely.

        The scores say where the fit of each begins; where that is no good, what acts in contacts begins at its usual size too,
        at several angles.
        Where the plain model fails, the search is thorough: all are fitted roughly, with the slopes of the model that they
        extend and their own at their start.  A score follows straight lines; these fits go beyond.
        """
        # what acts from the first contact on shows before the paths part
        suspects = [s for s in self.suspects if horizon <= self.stages.followed or s.declared.kind.builds_up]
        bases = [best, *elsewhere(best, horizon, field)]
        asked = [(base, score) for base in bases for score in worth_fitting(base, horizon, suspects, field, thorough)]
        crew = best.problem.crew
        tried = crew.apart(
            begun, [(base, score.suspect, score.start, horizon <= self.stages.sound) for base, score in asked]
        )
        rough = [
            each.at_home(base, (*base.causes, score.suspect))
            for each, (base, score) in zip(tried, asked, strict=True)
            if each is not None
        ]
        rough.sort(key=lambda each: each.bic)
        if not thorough:  # then its values are right, and little can be missing
            return self._weak(best, rough, [score for _, score in asked], horizon), frozenset()
        likely, others = admitted(rough, [score.suspect for _, score in asked[:_PROMISED]])
        fitted = with_own_slopes(likely, horizon)
        wavy = where_waves_look_likely(best, fitted)
        explained = any(best.misfit - each.misfit > _FURTHER_TAKES * best.excess for each in fitted)
        if not explained and not best.causes and horizon <= self.stages.sound:
            fitted += with_own_slopes(others, horizon)
        if best.causes:
            fitted = [each for each in fitted if best.misfit - each.misfit > _FURTHER_TAKES_ROUGHLY * best.excess]
        seats = _SEATED if self.rounds == _ROUNDS - 1 or horizon <= self.stages.touched else _SEATED_LATER
        ranked = siblings_first(best_of_each_name(fitted))[:seats]
        seated: list[Contender] = []
        for place in range(0, len(ranked), 2):
            seated += all_from_the_fall(self.fallen, ranked[place : place + 2], self.horizons, _to_beat(best))
            won, rest = min(seated, key=lambda each: each.bic, default=best), ranked[place + 2 :]
            if _explained(best, seated):
                # what the first contact meets looks alike until the next one
                if horizon > self.stages.touched or all(each.misfit > _ALIKE * won.misfit for each in rest):
                    break
            elif not won.fails and all(each.bic > won.bic + AHEAD for each in rest):
                break
        return seated, wavy

    def _weak(
        self, best: Contender, rough: Sequence[Contender], asked: Sequence[Score], horizon: float
    ) -> list[Contender]:
        """Return those fitted roughly, the best first, that come out best beside a model that leaves noise alone.

        Its values have made up for what is so weak, and a fit that begins at them stays there: who promises most is fitted from
        the fall on too, from where its score says and from where the slopes of its own led.
        """
        said = promising(best, asked)
        promised = [score.suspect for score in said]
        first = [each for each in rough if each.causes[-1] in promised]
        others = [each for each in rough if each not in first][:_PROMISED]
        fitted = with_own_slopes([*first, *others], horizon)
        leading = best_of_each_name(fitted)[:WEAK]
        near = [settled(e, horizon, SLOPES) for e in fitted if e in leading or e.causes[-1] in promised]
        led = [each for each in near if each.causes[-1] in promised]
        return best_of_each_name([*near, *self._promised_from_the_fall(best, said, led)])

    def weak_beside(self, best: Contender) -> list[Contender]:
        """Return a model with causes that leaves little more than noise with one more, by which most of that little goes.

        Scores promise less of it than a fit takes away, since values have made up for it.
        """
        return self._more_than_half(best, self._definite(best, _FURTHER_PROMISES))

    def _definite(self, best: Contender, share: float = 0.0) -> list[Contender]:
        """Return a contender with each cause that promises a share of what it leaves, fitted from the fall on.

        Asked are those that do not fit a little of anything.
        """
        others = [each for each in self.suspects if each.name not in best.effects and not each.fits_much]
        said = promising(best, scores(best.problem, best.fit, best.horizon, others), share)
        return self._promised_from_the_fall(best, said)

    def _promised_from_the_fall(
        self, best: Contender, said: Sequence[Score], led: Sequence[Contender] = ()
    ) -> list[Contender]:
        """Return the best contender with each cause that a score promises, and others, fitted from the fall on."""
        joining = [joined(best, score.suspect, score.start) for score in said]
        begun = [*(each for each in joining if each is not None), *led]
        return all_from_the_fall(self.fallen, begun, self.horizons, _to_beat(best))


def _to_beat(best: Contender) -> float:
    """Return the misfit that one cause more must come below: beside the plain model none."""
    return best.misfit if best.causes else math.inf


def _explained(best: Contender, found: Sequence[Contender]) -> bool:
    """True where one of those found takes away nearly all that the best contender leaves beyond noise."""
    return any(best.misfit - each.misfit > _CLEARLY * best.excess for each in found)


def where_waves_look_likely(best: Contender, fitted: Sequence[Contender]) -> frozenset[str]:
    """Return the bearings at which waves, lobes or a ball explain most of all and yet not much: values have made up for them.

    None where something else explains more.  A bearing that explains far less than the other is as it should be.
    """
    won = min(fitted, key=lambda each: each.bic, default=best)
    takes = best.misfit - won.misfit
    if won is best or not won.causes[-1].fits_much or takes <= RIVAL_TAKES * best.excess:
        return frozenset()
    waves = [each for each in fitted if each.causes[-1].fits_much]
    return frozenset(each.causes[-1].where for each in waves if best.misfit - each.misfit > _WAVES_TAKE * takes)


def of_size(found: Sequence[Contender], best: Contender) -> list[Contender]:
    """Return those found beside the best model that are no less than every machine has, or needed, or no imitation of such.

    What explains clearly less than a cause next to nothing may only look like it.
    """
    small = [each for each in found if each.negligible and not _needed(each, best)]
    least = min((each.bic for each in small), default=math.inf)
    return [each for each in found if each not in small and each.bic < least + SURE]


def _needed(small: Contender, best: Contender) -> bool:
    """True where a cause next to nothing explains what the best model without it leaves plainly: then it is there."""
    return best.fails and not small.fails and best.misfit - small.misfit > _CLEARLY * best.excess
