"""The contest of models: the plain one, and extended ones with up to three causes.

The horizon grows from the free fall past the first contacts.  Where the leader fails, every suspect is added to it and fitted
up to that horizon: roughly, with the Jacobian already known; the best of them once more with a Jacobian of their own.  The best
models go on to the next horizon; those that fall behind drop out.  So models are compared where the leader begins to fail,
before wrong values have compensated for the missing cause.

The best is followed beyond the last common horizon, for causes that act late.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.bases import only_parts
from tdbmon.diagnosis.contender import (
    AHEAD,
    FEW_SLOPES,
    HARDLY,
    MOST_CAUSES,
    NEARLY,
    PLAIN_LEAD,
    SIMPLER,
    SLOPES,
    Contender,
    leader,
    plain_of,
    replaced,
    settled,
    weighed,
)
from tdbmon.diagnosis.exchanged import exchanged
from tdbmon.diagnosis.held_out import LEAST_DROPS, proof_of, proved_beside
from tdbmon.diagnosis.search import Search
from tdbmon.diagnosis.simplified import HOPELESS, hardly_fails, simplified
from tdbmon.diagnosis.stated import explained, explained_by_stated_values, plain_beside, with_stated_values_free
from tdbmon.diagnosis.suspects import Suspect
from tdbmon.diagnosis.twins import with_twins
from tdbmon.diagnosis.wrong_minimum import LITTLE_EXPLAINED, Way, WaysOut
from tdbmon.identify.least_squares import fit
from tdbmon.identify.problem import Problem
from tdbmon.identify.robust import FLOOR
from tdbmon.identify.stages import Stages
from tdbmon.progress import Progress

_CONTENDERS = 3  # models that go on to the next horizon
_DOUBT = 0.5  # of the leader's own excess, added to the BIC lead with which it has won
_BEHIND = 1.5  # times the leader's misfit ratio: models that leave more drop out
# misfit ratio of the plain model, in units of the best one that held, from which an earlier horizon decides
_FAILED_BY_THEN = 1.25
# the contest ends after so many horizons in a row at which the lowest misfit ratio is above this; after one if a search failed
_LOST, _LOST_HORIZONS = 3.0, 2
_ACTS_LATER = 2.5  # times the floor: more than diverging paths leave
_MILD = 2.0  # times the floor: inexact laws leave less when they begin to show


def contest(
    problem: Problem, suspects: Sequence[Suspect], horizons: Sequence[float], progress: Progress
) -> list[Contender]:
    """Return the models at the last horizon, the best first; the plain model is always among them.

    Raises
    ------
    InputError
        If the plain model cannot be simulated.
    """
    fallen = fit(problem, problem.start, horizons[0], SLOPES)
    # a cause may act in the fall already and raise its misfit: noise alone leaves no more than it did before the release
    floor = min(fallen.ratio, FLOOR)
    plain = Contender((), problem, fallen, horizons[0], floor)
    running = _Contest(Search(plain, suspects, horizons, progress), plain)
    over = running.run_to([horizon for horizon in horizons if horizon <= problem.stages.followed])
    running.simplify()
    later = [horizon for horizon in horizons if horizon > problem.stages.followed]
    if later and not over:
        early = replace(running)
        running.run_to(later)
        running.simplify()
        if running.parts_from(early, floor):
            running = early
    running.settle_laws()
    before = [running.plain, *running.others]
    compared = with_twins(before, running.best, suspects, horizons)
    plain = plain_of(compared)
    others = [each for each in compared if each.causes]
    if min(compared, key=lambda each: each.bic) not in before:
        # a negligible cause may have led the fit out of a wrong minimum
        plain, others = simplified(plain, others)
    plain = plain_beside(plain, min([plain, *others], key=lambda each: each.bic))
    return sorted([plain, *others], key=lambda each: each.bic)


@dataclass
class _Contest:
    """A contest under way.

    Attributes
    ----------
    search : Search
    plain : Contender
    others : list of Contender
        The other models.
    horizon : float
        Last horizon at which they were compared, s.
    held : tuple of Contender
        The other models at the last horizon, if one of them held there.
    ways : WaysOut
        Ways out of a wrong minimum, with a record of those tried.
    freed : bool
        Whether values stated without tolerance are free, or were tried for the last time.
    decided : bool
        Whether one model has won and goes on alone, even without the plain model.
    lost : int
        Horizons in a row at which no model explained the drops.
    """

    search: Search
    plain: Contender
    others: list[Contender] = field(default_factory=list)
    horizon: float = 0.0
    held: tuple[Contender, ...] = ()
    freed: bool = False
    decided: bool = False
    lost: int = 0
    ways: WaysOut = field(init=False)

    def __post_init__(self) -> None:
        """Start with no way tried."""
        self.ways = WaysOut(self.search)

    @property
    def stages(self) -> Stages:
        """Horizons of the steps of fits and judgements."""
        return self.search.stages

    @property
    def best(self) -> Contender:
        """The leader at the present horizon."""
        return leader(self.plain, self.others, self.horizon)

    def run_to(self, horizons: Sequence[float]) -> bool:
        """Compare the models at horizons in turn; True if the contest was over before the last of them."""
        return any(self._over(horizon) for horizon in horizons)

    def simplify(self) -> None:
        """Replace models by simpler ones that fit as well with fewer causes."""
        self._settle_plain()
        self.plain, self.others = simplified(self.plain, self.others)

    def settle_laws(self) -> None:
        """Replace the law of a cause by another that leaves less, since its size depends on the law."""
        best = self.best
        if best.ratio <= NEARLY:
            self._replace(best, self.ways.by_better_laws(best))

    def parts_from(self, early: _Contest, floor: float) -> bool:
        """True if paths have diverged since an earlier state of the contest, which then decides.

        A cause that led earlier is refuted where the plain model now leads and leaves noise alone.
        """
        led = early.best.bic <= early.plain.bic - PLAIN_LEAD
        if led and (self.best.causes or self.best.fails):
            return not self.adds_to(early.best)
        return self.plain.ratio < _ACTS_LATER * floor and self.best.fails

    def adds_to(self, named: Contender) -> bool:
        """True if the leader holds with a cause in addition to those of `named`, proved on a held-out drop.

        The further cause needs a proof against `named`: against the plain model, the gain of the other causes would suffice for
        both.  Without a second drop there is no proof.
        """
        best = self.best
        if best.fails or not named.effects < best.effects or len(best.problem.drops) < LEAST_DROPS:
            return False
        try:
            before = settled(named, self.horizon, SLOPES)
            return before.ratio > HARDLY * before.floor and proof_of(before, best).seen
        except InputError:
            return False

    def _add_weak_cause(self) -> None:
        """Add the leader with one more cause to the contest, if that takes away most of a small excess.

        Like a weak cause beside the plain model, the cause must be proved on held-out drops.
        """
        best = self.best
        may = 0 < len(best.causes) < MOST_CAUSES and self.search.weak and len(best.problem.drops) >= LEAST_DROPS
        if not may or best.fails_beside(self.plain):
            return
        wider = min(self.search.weak_beside(best), key=lambda each: each.bic, default=best)
        if wider.bic > best.bic - SIMPLER:
            return
        with suppress(InputError):
            if proved_beside(best, wider, proof_of(best, wider)):
                self.others = [*self.others, wider]

    def _begins_to_fail(self) -> bool:
        """True if a model with one cause begins to fail: at later horizons its values would compensate for a second cause."""
        best = self.best
        begins = best.fails and len(best.causes) == 1 and self.stages.sound < self.horizon < self.search.last
        return begins and self.ways.untried(Way.FURTHER, best.name)

    def _settle_plain(self) -> None:
        """Fit the plain model to the present horizon, if it was not fitted as far as the others."""
        if self.plain.horizon < self.horizon:
            self.plain = settled(self.plain, self.horizon, FEW_SLOPES)

    def _over(self, horizon: float) -> bool:
        """Compare the models at a horizon; True if the contest is over there."""
        self.search.progress(f"fitting the first {horizon * 1e3:g} ms")
        self.horizon = horizon
        self._refit()
        # another cause can be started at the first contacts only if something is missing there
        may_be_another = bool(self.held) and self.search.began <= self.stages.sound and horizon <= self.stages.followed
        if (
            horizon <= self.stages.followed or not self.best.causes
        ):  # later on a leading cause stands, and paths diverge
            self._deepen()
            self._free_stated_values()
            if may_be_another and horizon > self.stages.sound:
                self._exchange()
        rounds, before = self.search.rounds, self.best
        self.plain, self.others = self.search.compared(self.plain, self.others, horizon)
        if may_be_another and self.search.rounds < rounds and self.best is before:  # no further cause helped
            self._exchange()
        if before.causes and self._try_other_kinds(before):
            self.plain, self.others = self.search.compared(self.plain, self.others, horizon)
        if horizon == self.search.last or self._begins_to_fail():
            self._add_weak_cause()
        searched = self.search.rounds < rounds
        least = min(each.ratio for each in [self.plain, *self.others])
        self.others = _kept(self.others)
        if self._return_to_earlier() or self._given_up(least, searched):
            return True
        if not self.decided and horizon >= self.stages.bounced and decided(self.plain, self.others, horizon):
            self.others = [self.best]
            self.decided = self.plain.ratio > _BEHIND * self.best.ratio
        return False

    def _refit(self) -> None:
        hopeless = self.decided or (
            self.plain.ratio > HOPELESS and any(self.plain.ratio > 2 * each.ratio for each in self.others)
        )
        if not hopeless:
            self.plain = settled(self.plain, self.horizon, SLOPES)
        self.others = _refitted(self.others, self.horizon)
        # an excess is judged against the plain model's, which grows with the horizon
        if hopeless and all(each.fails_beside(self.plain) for each in self.others):
            self._settle_plain()

    def _deepen(self) -> None:
        """Lead the leader out of a wrong minimum, if it is in one."""
        best = self.best
        self._replace(best, self.ways.deepened(best, self.plain, held=bool(self.held), decided=self.decided))

    def _try_other_kinds(self, before: Contender) -> bool:
        """Try other waves, lobes or balls in the place of a failing leader's; True if the leader changes.

        This follows the search for a further cause, which is likelier before paths diverge and takes a tenth of the time.  If
        that search extended the leader `before` it, the new cause may only compensate for a wrong order, so the exchange is tried
        in `before`.
        """
        best = self.best
        if not self.stages.touched <= self.horizon <= self.stages.sound:
            return False
        if best.fails_with_causes(self.plain):
            self._replace(best, self.ways.of_any_kind(best, self.plain))
        elif len(best.causes) > len(before.causes) and before.fails_with_causes(self.plain):
            anew = self.ways.of_any_kind(before, self.plain)
            if anew is not before:
                self.others = [*self.others, anew]
        return self.best is not best

    def _exchange(self) -> None:
        """Try other causes in the place of a failing leader's last one, if that acts in contacts."""
        best = self.best
        may = best.fails_with_causes(self.plain) and best.causes[-1].in_contacts
        if may and self.ways.untried(Way.EXCHANGED, best.name):
            self.search.progress("trying other causes, from the fall on, in place of the one that now fails")
            self._replace(best, exchanged(self.search.fallen, best, self.search.suspects, self.search.horizons))

    def _replace(self, old: Contender, new: Contender) -> None:
        self.plain, self.others = replaced(self.plain, self.others, old, new)

    def _free_stated_values(self) -> None:
        best = self.best
        if self.freed or not best.fails_beside(self.plain) or only_parts(best):
            return
        seen = explained_by_stated_values(best)
        if not seen and not self._may_have_compensated(best):
            return
        self.search.progress("fitting also the values that the machine file states without tolerance")
        found = with_stated_values_free(self.search.fallen, [self.plain, *self.others], self.search.horizons)
        self.freed = seen or self.horizon >= self.stages.late  # not tried again
        if found is None:
            return
        fallen, (plain, *others) = found
        if not seen and not explained(best, plain.misfit):
            return
        self.freed = True
        self.search.fallen, self.search.weak = fallen, False
        self.plain, self.others, self.held = plain, others, ()

    def _may_have_compensated(self, best: Contender) -> bool:
        """True if a plain model's values may have compensated for stated values that are off: a fit from the fall on decides.

        At the late horizons always, since a contact cause would have shown before; earlier once, where little is left: inexact
        laws show gradually, and a fit from values that have compensated for them understates what they explain.
        """
        if best.causes:
            return False
        if self.horizon >= self.stages.late:
            return True
        mild = self.horizon >= self.stages.sound and best.ratio < _MILD * best.floor
        return mild and self.ways.untried(Way.STATED)

    def _return_to_earlier(self) -> bool:
        """Return to the horizon at which models held that all fail now, if the plain model failed there; True if so.

        The models that held are the better evidence then, since paths diverge.  A model that hardly fails may hold again at a
        later horizon.
        """
        fine = any(not each.fails_beside(self.plain) for each in self.others)
        wavers = any(hardly_fails(each, self.plain) for each in self.others)
        late_enough = bool(self.held) and self.held[0].horizon >= self.stages.sound
        failed = tuple(replace(each, failed_s=each.failed_s or self.horizon) for each in self.held)
        if late_enough and not fine and not wavers:
            earlier = settled(self.plain, self.held[0].horizon, SLOPES)
            if earlier.ratio > _FAILED_BY_THEN * min(each.ratio for each in self.held):
                self.plain, self.others = earlier, list(failed)
                self.horizon = earlier.horizon
                return True
        self.held = tuple(self.others) if fine else failed if wavers else ()
        return False

    def _given_up(self, least: float, searched: bool) -> bool:
        """True if no model explains the contacts so far and no search is left that could.

        `least` is the lowest misfit ratio; `searched`: causes were searched for at this horizon.
        """
        self.lost = self.lost + 1 if least > _LOST else 0
        if self.horizon > self.stages.followed:
            return self.lost > 0
        none_left = not self.search.may_ask(self.best)
        # once both ends have touched, one failed search beside the leader's causes is enough, or none left
        in_vain = self.horizon >= self.stages.touched and (none_left or (searched and bool(self.best.causes)))
        enough = 1 if in_vain else _LOST_HORIZONS
        return self.lost >= enough or (none_left and least > LITTLE_EXPLAINED and self.horizon >= self.stages.bounced)


def decided(plain: Contender, field: Sequence[Contender], horizon: float) -> bool:
    """True if a model with causes leads, holds, and is clearly ahead of every model of other effects, the plain one included."""
    ranked = sorted((each for each in [plain, *field] if each.horizon == horizon), key=lambda each: each.bic)
    if not ranked or not ranked[0].causes or ranked[0].fails_beside(plain):
        return False
    rivals = [each for each in ranked[1:] if each.effects != ranked[0].effects]
    return all(each.bic > ranked[0].bic + AHEAD + _DOUBT * ranked[0].excess for each in rivals)


def _kept(field: Sequence[Contender]) -> list[Contender]:
    """Return the models that go on: the leader, and those not far behind."""
    ranked = sorted(field, key=lambda each: each.bic)[:_CONTENDERS]
    return [each for each in ranked if each.ratio < _BEHIND * ranked[0].ratio]


def _refitted(field: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return the models fitted to a horizon, the leader with more Jacobians than the others."""
    out = []
    for place, each in enumerate(sorted(field, key=lambda each: each.bic)):
        try:
            out.append(weighed(settled(each, horizon, SLOPES if place == 0 else FEW_SLOPES)))
        except InputError:
            continue
    return out
