"""The search for a cause that explains the excess of the best model.

Scores give each suspect's start point; rough fits with the Jacobian already known rank the suspects; fits with a Jacobian of
their own decide between the best.
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

_PROMISED = 5  # best scores, whose suspects get a Jacobian of their own too
_FROM_THE_FALL = 4  # candidates at most that are fitted from the fall on in the first search
_FROM_THE_FALL_LATER = 2  # the same in later ones
_CLEARLY = 0.8  # share of the excess: a candidate that takes away so much makes worse ones superfluous
# times the floor: a plain model that leaves less at the last common horizon is in a wrong minimum, or its paths diverge
_PARTING = 1.5
_ALIKE = 2.0  # greatest misfit of a look-alike at the first contacts, in units of the best one's
# share of what waves, lobes or a ball take away at one bearing from which those at the other are tried too
_WAVES_TAKE = 1 / 3
_ROUNDS = 5  # searches over all suspects, at most
# of these, reserved for further causes: if three found no first cause, there is none in the catalogue
_KEPT_FOR_FURTHER = 2
_FURTHER_TAKES = 0.5  # share of the excess that a further cause must take away
_FURTHER_PROMISES = 0.25  # share of the excess that its score must promise where little is left
_FURTHER_TAKES_ROUGHLY = 0.3  # share of the excess that it must take away before it is fitted from the fall on


@dataclass
class Search:
    """The search for causes: its suspects, the rounds left, and what was tried before.

    Attributes
    ----------
    fallen : Contender
        The plain model, fitted to the fall before the first contact.
    suspects : sequence of Suspect
    horizons : sequence of float
        s.
    progress : callable
    rounds : int
        Searches over all suspects that are left.
    weak : bool
        Whether a further cause is sought for a model with causes that leaves little; not where laws are known to be inexact.
    began : float
        Horizon of the first search, s.
    tried : Contender or None
        The plain model, fitted to the fall, beside which contact causes were started in the fall.
    searched : dict
        Horizon of the last search beside each model, s, by the model's name.
    first_contact_fits : FirstContactFits
        Fits of the plain model with waves, lobes and balls to where both ends have touched.
    """

    fallen: Contender
    suspects: Sequence[Suspect]
    horizons: Sequence[float]
    progress: Progress
    rounds: int = _ROUNDS
    weak: bool = True
    began: float = math.inf
    tried: Contender | None = None
    searched: dict[str, float] = field(default_factory=dict)
    first_contact_fits: FirstContactFits = field(default_factory=dict)

    @property
    def stages(self) -> Stages:
        """Horizons of the steps of fits and judgements."""
        return self.fallen.problem.stages

    @property
    def last(self) -> float:
        """Last common horizon of all models, s."""
        return max(h for h in self.horizons if h <= self.stages.followed)

    def may_ask(self, best: Contender) -> bool:
        """True if rounds are left for a search beside the leader."""
        return self.rounds > (0 if best.causes else _KEPT_FOR_FURTHER)

    def compared(self, plain: Contender, field: list[Contender], horizon: float) -> tuple[Contender, list[Contender]]:
        """Search for causes that explain the leader's excess, and return the plain model and the others with those found."""
        best = leader(plain, field, horizon)
        if best.hardly_better(plain):
            best = plain  # a leader that explains next to nothing stays, but the search goes on beside the plain model
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
        """True if a cause is sought beside the leader: where it fails, or at the last common horizon for weak causes."""
        if len(best.causes) >= MOST_CAUSES or not self.may_ask(best) or only_parts(best):
            return False
        # before paths diverge, an excess is due to a cause more often than to an inexact law
        early = best.fails and horizon <= self.stages.sound
        return best.fails_beside(plain) or early or self._may_lack_weak_cause(best, horizon)

    def _may_lack_weak_cause(self, best: Contender, horizon: float) -> bool:
        """True for a plain model at the last common horizon: weak causes may show only there."""
        return horizon == self.last and not best.causes and not slows_otherwise(best)

    def _fails_plainly(self, best: Contender, horizon: float) -> bool:
        """True if the search beside a model is thorough.

        A plain model that begins to fail only at a late horizon is more often in a wrong minimum than lacking a cause.
        """
        parts = _PARTING if horizon >= self.last else HARDLY
        hardly = horizon >= self.stages.late and not best.causes and best.ratio < parts * best.floor
        return best.fails and not hardly

    def _deeper(self, best: Contender, found: Sequence[Contender], horizon: float) -> Contender:
        """Return the leader, or the same model in a deeper minimum that the models found may have led to."""
        # a leader that holds is searched beside for weak causes only
        if not best.fails and min(each.bic for each in found) < best.bic - SURE:
            # a better model may only have found the path that a plain model in a wrong minimum lost
            best = self._from_several_starts(best)
        # a negligible cause may have led the fit out of a wrong minimum
        led = without_last([each for each in found if each.negligible], horizon)
        deeper = min([best, *(each for each in led if each.causes == best.causes)], key=lambda each: each.misfit)
        return deeper if deeper.misfit < best.misfit - SURE else best

    def _found_beside(
        self, best: Contender, plain: Contender, horizon: float, field: Sequence[Contender], thorough: bool
    ) -> list[Contender]:
        """Return models that explain the leader's excess: it, or another of the field, with one more cause.

        Before paths diverge, another cause in the place of the leader's last one is tried first: it may show only now.  Of two
        causes that act, the first may look like a third until both are in the model, so where no further cause helps the leader,
        one is sought beside its rivals.
        """
        bases = [
            *(each for each in extended_by(best, [plain, *field], horizon) if self.searched.get(each.name) != horizon),
            best,
            *others_of_the_field(best, plain, horizon, field),
        ]
        at: frozenset[str] = frozenset()
        found: list[Contender] = []
        for base in bases:
            candidates, wavy = self._candidates(base, horizon, field, thorough)
            self.searched[base.name] = horizon
            at = wavy if base is best else at
            found = self._explaining_enough(best, candidates)
            holding = [each for each in found if not each.fails]
            # values compensate for a small oval too, and lobes then fit the rest of it
            if thorough and holding and all(each.causes[-1].fits_much for each in holding):
                found += self._explaining_enough(best, self._most_promising(base))
            if found and best.causes:
                return found
        if thorough and self._shows_from_the_fall(best, horizon, found):
            found += self._explaining_enough(best, self._begun_in_the_fall(bases, horizon))
        # a model that holds without waves, lobes or a ball does not do so by chance
        if at and not _explained(best, found) and all(each.fails or each.fits_much for each in found):
            found += self._explaining_enough(best, self._waves(best, horizon, at))
        return found

    def _from_several_starts(self, plain: Contender) -> Contender:
        """Return the plain model, or the same followed from the fall on from several starts, whichever leaves less."""
        self.progress("fitting the plain model from several starts")
        horizons = [h for h in self.horizons if h <= plain.horizon]
        try:
            _, passed = followed(plain.problem, horizons, silent, may_widen=False)
        except InputError:
            return plain
        return min([plain, replace(plain, fit=passed[-1].fit)], key=lambda each: each.misfit)

    def _shows_from_the_fall(self, best: Contender, horizon: float, found: Sequence[Contender]) -> bool:
        """True if contact causes are worth starting in the fall, given what was found beside the leader."""
        if best.causes:
            return horizon <= self.stages.sound
        unexplained = not _explained(best, found) and all(each.fails for each in found)
        return self.stages.touched <= horizon <= self.stages.followed and unexplained

    def _best_in_the_fall(self, bases: Sequence[Contender]) -> Contender | None:
        """Return the model without contact causes that fits the fall best, where no contact plays a part; None without one."""
        outside = [each for each in bases if not each.in_contacts]
        if len(outside) < 2:
            return outside[0] if outside else None
        fall = self.horizons[0]
        return min(outside, key=lambda each: settled(each, fall, FEW_SLOPES).bic)

    def _explaining_enough(self, best: Contender, found: Sequence[Contender]) -> list[Contender]:
        """Return the models that take away enough of the leader's excess: half, or anything if it is the plain model."""
        least = _FURTHER_TAKES * best.excess if best.causes else -math.inf
        return [weighed(each) for each in found if best.misfit - each.misfit > least]

    def _begun_in_the_fall(self, bases: Sequence[Contender], horizon: float) -> list[Contender]:
        """Return the best model without contact causes plus a contact cause, started in the fall at usual size and four angles.

        Scores say little once values have compensated for the cause.  Beside the plain model only once per fit to the fall, since
        the result would be the same.
        """
        base = self._best_in_the_fall(bases)
        if base is None or (not base.causes and self.tried is self.fallen):
            return []
        if not base.causes:
            self.tried = self.fallen
        others = [each for each in self.suspects if not each.fits_much]
        horizons = [h for h in self.horizons if h <= horizon]
        ranked = at_usual_size(self.fallen, base.known, others, horizons)[:_FROM_THE_FALL_LATER]
        ranked = [each for each in ranked if each.misfit < _ALIKE * ranked[0].misfit]
        return best_of_each_name(followed_on(ranked, [h for h in horizons if h >= min(horizon, self.stages.touched)]))

    def _waves(self, best: Contender, horizon: float, at: frozenset[str]) -> list[Contender]:
        """Return the contender with waves, lobes or a ball at some bearings, started at usual size at the first contact.

        By the time a model fails, gap, clearance and cages have compensated for them, and a fit that starts there finds next to
        nothing.  Not at the last common horizon, nor where a model with causes hardly fails after 18 ms: there paths diverge.
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

    def _candidates(
        self, best: Contender, horizon: float, field: Sequence[Contender], thorough: bool
    ) -> tuple[list[Contender], frozenset[str]]:
        """Return the fitted models with the suspects that explain most, and the bearings where waves look likely.

        Scores give the start points; where these fail, contact causes are also started at their usual size and several angles.
        In a thorough search beside the plain model all suspects are fitted roughly, since a score is only linear: with the
        Jacobian of the model that they extend, and their own columns of it at the start point.
        """
        # after the last common horizon only causes that build up: all others show before paths diverge
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
        if not thorough:  # the model's values are right then, and little can be missing
            return self._weak_causes(best, rough, [score for _, score in asked], horizon), frozenset()
        likely, others = admitted(rough, [score.suspect for _, score in asked[:_PROMISED]])
        fitted = with_own_slopes(likely, horizon)
        wavy = where_waves_look_likely(best, fitted)
        explained = any(best.misfit - each.misfit > _FURTHER_TAKES * best.excess for each in fitted)
        if not explained and not best.causes and horizon <= self.stages.sound:
            fitted += with_own_slopes(others, horizon)
        if best.causes:
            fitted = [each for each in fitted if best.misfit - each.misfit > _FURTHER_TAKES_ROUGHLY * best.excess]
        first = self.rounds == _ROUNDS - 1 or horizon <= self.stages.touched
        ranked = siblings_first(best_of_each_name(fitted))[: _FROM_THE_FALL if first else _FROM_THE_FALL_LATER]
        refitted: list[Contender] = []
        for place in range(0, len(ranked), 2):
            refitted += all_from_the_fall(self.fallen, ranked[place : place + 2], self.horizons, _to_beat(best))
            won, rest = min(refitted, key=lambda each: each.bic, default=best), ranked[place + 2 :]
            if _explained(best, refitted):
                # causes that look alike at the first contact differ at the next one
                if horizon > self.stages.touched or all(each.misfit > _ALIKE * won.misfit for each in rest):
                    break
            elif not won.fails and all(each.bic > won.bic + AHEAD for each in rest):
                break
        return refitted, wavy

    def _weak_causes(
        self, best: Contender, rough: Sequence[Contender], asked: Sequence[Score], horizon: float
    ) -> list[Contender]:
        """Return the best of the roughly fitted models with one more cause than a model that holds, refitted, the best first.

        The model's values have compensated for so weak a cause, and a fit that starts there stays there.  So the most promising
        causes are also fitted from the fall on, from their scores' start points and from their fits with a Jacobian of their own.
        """
        best_scores = promising(best, asked)
        promised = [score.suspect for score in best_scores]
        first = [each for each in rough if each.causes[-1] in promised]
        others = [each for each in rough if each not in first][:_PROMISED]
        fitted = with_own_slopes([*first, *others], horizon)
        leading = best_of_each_name(fitted)[:WEAK]
        near = [settled(e, horizon, SLOPES) for e in fitted if e in leading or e.causes[-1] in promised]
        also = [each for each in near if each.causes[-1] in promised]
        return best_of_each_name([*near, *self._promised_from_the_fall(best, best_scores, also)])

    def weak_beside(self, best: Contender) -> list[Contender]:
        """Return a model with causes and a small excess, with one more cause that takes away most of that excess.

        A score promises less than a fit takes away, since values have compensated for the cause.
        """
        return self._explaining_enough(best, self._most_promising(best, _FURTHER_PROMISES))

    def _most_promising(self, best: Contender, share: float = 0.0) -> list[Contender]:
        """Return the contender with each cause whose score promises a share of its excess, fitted from the fall on.

        Waves, lobes and balls are left out: they fit a little of anything.
        """
        others = [each for each in self.suspects if each.name not in best.effects and not each.fits_much]
        best_scores = promising(best, scores(best.problem, best.fit, best.horizon, others), share)
        return self._promised_from_the_fall(best, best_scores)

    def _promised_from_the_fall(
        self, best: Contender, best_scores: Sequence[Score], also: Sequence[Contender] = ()
    ) -> list[Contender]:
        """Return the contender with the suspect of each score, and the models `also`, all fitted from the fall on."""
        joining = [joined(best, score.suspect, score.start) for score in best_scores]
        begun = [*(each for each in joining if each is not None), *also]
        return all_from_the_fall(self.fallen, begun, self.horizons, _to_beat(best))


def _to_beat(best: Contender) -> float:
    """Return the misfit below which a model with one more cause must come: no limit beside the plain model."""
    return best.misfit if best.causes else math.inf


def _explained(best: Contender, found: Sequence[Contender]) -> bool:
    """True if one of the models found takes away nearly all of the leader's excess."""
    return any(best.misfit - each.misfit > _CLEARLY * best.excess for each in found)


def where_waves_look_likely(best: Contender, fitted: Sequence[Contender]) -> frozenset[str]:
    """Return the bearings at which waves, lobes or a ball are likely though values have compensated for them.

    None unless waves, lobes or a ball lead the candidates and take away a quarter of the excess.  The second bearing counts only
    if they take away a third as much there.
    """
    won = min(fitted, key=lambda each: each.bic, default=best)
    takes = best.misfit - won.misfit
    if won is best or not won.causes[-1].fits_much or takes <= RIVAL_TAKES * best.excess:
        return frozenset()
    waves = [each for each in fitted if each.causes[-1].fits_much]
    return frozenset(each.causes[-1].where for each in waves if best.misfit - each.misfit > _WAVES_TAKE * takes)


def of_size(found: Sequence[Contender], best: Contender) -> list[Contender]:
    """Return the models found whose causes are not negligible, or needed.

    A model that fits clearly worse than one with a negligible cause goes too: its cause may only look like that one.
    """
    small = [each for each in found if each.negligible and not _needed(each, best)]
    least = min((each.bic for each in small), default=math.inf)
    return [each for each in found if each not in small and each.bic < least + SURE]


def _needed(small: Contender, best: Contender) -> bool:
    """True if a model with a negligible cause holds and takes away nearly all of a failing leader's excess: it is real then."""
    return best.fails and not small.fails and best.misfit - small.misfit > _CLEARLY * best.excess
