"""Models that compete for the drops: the plain one, and those that a suspect or two extend.

The horizon grows from the free fall past the first contacts.  As soon as the best model fails, every suspect is fitted
to as far as it came: roughly, with slopes that are known; those that come out best once more with their own.  They go on
with it; those that fall behind drop out.  So the competition takes place where the model begins to fail, before wrong
values have made up for what it lacks.

The best is followed further than all are, for what acts later.
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

_CONTENDERS = 3  # contenders that go on to the next horizon
_DOUBT = 0.5  # of what it leaves beyond noise itself, by which it must be further ahead
_BEHIND = 1.5  # times the best ratio: who leaves more does not go on
# times what a cause leaves, that the plain model must leave where it is judged at an earlier horizon
_FAILED_BY_THEN = 1.25
# the best ratio at so many horizons running, where it is no use to go on; once is enough where a search was in vain
_LOST, _LOST_HORIZONS = 3.0, 2
_ACTS_LATER = 2.5  # times the floor: more than a path makes that only parts
_MILD = 2.0  # times the floor: as far as laws that are a little off lead when they begin to show


def contest(
    problem: Problem, suspects: Sequence[Suspect], horizons: Sequence[float], progress: Progress
) -> list[Contender]:
    """Return the contenders at the last horizon, the best first; the plain model is always among them.

    Raises
    ------
    InputError
        If the plain model cannot be simulated.
    """
    fallen = fit(problem, problem.start, horizons[0], SLOPES)
    # an effect may show in the fall already: then the noise is no less than it was before the release
    floor = min(fallen.ratio, FLOOR)
    plain = Contender((), problem, fallen, horizons[0], floor)
    held = _Contest(Search(plain, suspects, horizons, progress), plain)
    over = held.run_to([horizon for horizon in horizons if horizon <= problem.stages.followed])
    held.simplify()
    later = [horizon for horizon in horizons if horizon > problem.stages.followed]
    if later and not over:
        early = replace(held)
        held.run_to(later)
        held.simplify()
        if held.parts_from(early, floor):
            held = early
    held.settle_laws()
    before = [held.plain, *held.others]
    compared = with_twins(before, held.best, suspects, horizons)
    plain = plain_of(compared)
    others = [each for each in compared if each.causes]
    if min(compared, key=lambda each: each.bic) not in before:
        # a cause that is next to nothing may have led to the paths that were found
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
        s, to which they were compared last.
    sound : tuple of Contender
        The other models, if one of them left noise alone there.
    ways : WaysOut
        Of a wrong minimum, which remember what was tried.
    freed : bool
        Whether what the machine file states without tolerance is free, or was tried for the last time.
    decided : bool
        Whether one model has won and goes on alone, without the plain one even.
    lost : int
        Horizons running at which nothing explained the drops.
    """

    search: Search
    plain: Contender
    others: list[Contender] = field(default_factory=list)
    horizon: float = 0.0
    sound: tuple[Contender, ...] = ()
    freed: bool = False
    decided: bool = False
    lost: int = 0
    ways: WaysOut = field(init=False)

    def __post_init__(self) -> None:
        """Know of no way that was tried."""
        self.ways = WaysOut(self.search)

    @property
    def stages(self) -> Stages:
        """Up to where models are fitted and judged."""
        return self.search.stages

    @property
    def best(self) -> Contender:
        """The leader at the horizon."""
        return leader(self.plain, self.others, self.horizon)

    def run_to(self, horizons: Sequence[float]) -> bool:
        """Let the models meet at horizons in turn; True where the contest was over before the last of them."""
        return any(self._over(horizon) for horizon in horizons)

    def simplify(self) -> None:
        """Put simpler models in the place of those that need a cause less and leave noise alone just as well."""
        self._settle_plain()
        self.plain, self.others = simplified(self.plain, self.others)

    def settle_laws(self) -> None:
        """Put another law of a cause in its place, where it leaves less: sizes hang on it."""
        best = self.best
        if best.ratio <= NEARLY:
            self._replace(best, self.ways.by_better_laws(best))

    def parts_from(self, early: _Contest, floor: float) -> bool:
        """True where paths with impacts have parted since a contest as it stood earlier, which then counts.

        A cause that led is refuted where the plain model leaves noise alone for longer.
        """
        led = early.best.bic <= early.plain.bic - PLAIN_LEAD
        if led and (self.best.causes or self.best.fails):
            return not self.adds_to(early.best)
        return self.plain.ratio < _ACTS_LATER * floor and self.best.fails

    def adds_to(self, named: Contender) -> bool:
        """True where the best model has a cause beyond those of one that was followed on, proved on a drop held out.

        That proof is its own: the other causes gain enough for both.  One drop alone proves nothing.
        """
        best = self.best
        if best.fails or not named.effects < best.effects or len(best.problem.drops) < LEAST_DROPS:
            return False
        try:
            before = settled(named, self.horizon, SLOPES)
            return before.ratio > HARDLY * before.floor and proof_of(before, best).seen
        except InputError:
            return False

    def _add_what_is_weak(self) -> None:
        """Put the best model with one cause more in the contest, which takes away most of the little that it leaves beyond noise.

        It must be proved on drops held out, as a weak cause beside the plain model is.
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
        """True where one cause leaves a little more than noise for the first time: later on values make up for a second one."""
        best = self.best
        begins = best.fails and len(best.causes) == 1 and self.stages.sound < self.horizon < self.search.last
        return begins and self.ways.untried(Way.FURTHER, best.name)

    def _settle_plain(self) -> None:
        """Fit the plain model as far as the others, where it had been left behind."""
        if self.plain.horizon < self.horizon:
            self.plain = settled(self.plain, self.horizon, FEW_SLOPES)

    def _over(self, horizon: float) -> bool:
        """Let the models meet at a horizon; True where no further one would help."""
        self.search.progress(f"fitting the first {horizon * 1e3:g} ms")
        self.horizon = horizon
        self._refit()
        # the first contacts tell causes apart only where they show in them
        may_be_another = bool(self.sound) and self.search.began <= self.stages.sound and horizon <= self.stages.followed
        if horizon <= self.stages.followed or not self.best.causes:  # a cause is named by then, and paths part
            self._deepen()
            self._free_stated_values()
            if may_be_another and horizon > self.stages.sound:
                self._exchange()
        rounds, came = self.search.rounds, self.best
        self.plain, self.others = self.search.compared(self.plain, self.others, horizon)
        if may_be_another and self.search.rounds < rounds and self.best is came:  # one more cause is in vain
            self._exchange()
        if came.causes and self._met_by_another_kind(came):
            self.plain, self.others = self.search.compared(self.plain, self.others, horizon)
        if horizon == self.search.last or self._begins_to_fail():
            self._add_what_is_weak()
        searched = self.search.rounds < rounds
        least = min(each.ratio for each in [self.plain, *self.others])
        self.others = _kept(self.others)
        if self._earlier_witness() or self._given_up(least, searched):
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
        # how much is left is judged by what the plain model leaves, which is more at each horizon
        if hopeless and all(each.fails_beside(self.plain) for each in self.others):
            self._settle_plain()

    def _deepen(self) -> None:
        """Lead the best model out of a wrong minimum, if it is in one."""
        best = self.best
        self._replace(best, self.ways.deepened(best, self.plain, held=bool(self.sound), decided=self.decided))

    def _met_by_another_kind(self, came: Contender) -> bool:
        """Try other waves, lobes or balls in the place of the best model's, which fails still; True where one of them is better.

        While paths have hardly parted another cause is the likelier, and takes a tenth of the time to find.  But one more beside
        those of the model that `came` to the horizon may only make up for its wrong order.
        """
        best = self.best
        if not self.stages.touched <= self.horizon <= self.stages.sound:
            return False
        if best.fails_with_causes(self.plain):
            self._replace(best, self.ways.of_any_kind(best, self.plain))
        elif len(best.causes) > len(came.causes) and came.fails_with_causes(self.plain):
            anew = self.ways.of_any_kind(came, self.plain)
            if anew is not came:
                self.others = [*self.others, anew]
        return self.best is not best

    def _exchange(self) -> None:
        """Try others in the place of the best model's last cause, which acts in contacts and fails now."""
        best = self.best
        may = best.fails_with_causes(self.plain) and best.causes[-1].in_contacts
        if may and self.ways.untried(Way.EXCHANGED, best.name):
            self.search.progress("beginning other causes in the fall, in the place of the one that fails now")
            self._replace(best, exchanged(self.search.fallen, best, self.search.suspects, self.search.horizons))

    def _replace(self, old: Contender, new: Contender) -> None:
        self.plain, self.others = replaced(self.plain, self.others, old, new)

    def _free_stated_values(self) -> None:
        best = self.best
        if self.freed or not best.fails_beside(self.plain) or only_parts(best):
            return
        seen = explained_by_stated_values(best)
        if not seen and not self._may_have_made_up(best):
            return
        self.search.progress("fitting what the machine file states without tolerance too")
        found = with_stated_values_free(self.search.fallen, [self.plain, *self.others], self.search.horizons)
        self.freed = seen or self.horizon >= self.stages.late  # asked for the last time
        if found is None:
            return
        fallen, (plain, *others) = found
        if not seen and not explained(best, plain.misfit):
            return
        self.freed = True
        self.search.fallen, self.search.weak = fallen, False
        self.plain, self.others, self.sound = plain, others, ()

    def _may_have_made_up(self, best: Contender) -> bool:
        """True where a plain model may hide that stated values are off, so that these are worth a fit from the fall on.

        What acts in contacts from the first on has shown by the late horizons.  Laws that are a little off begin to show
        little by little, and more than a fit tells from where its values have made up for them: asked once before that.
        """
        if best.causes:
            return False
        if self.horizon >= self.stages.late:
            return True
        mild = self.horizon >= self.stages.sound and best.ratio < _MILD * best.floor
        return mild and self.ways.untried(Way.STATED)

    def _earlier_witness(self) -> bool:
        """Go back to where models held that fail now, if the plain one had failed there already; True if so.

        What held up to there is the better witness then: neighbouring paths part.  Who hardly fails may hold again further on.
        """
        fine = any(not each.fails_beside(self.plain) for each in self.others)
        wavers = any(hardly_fails(each, self.plain) for each in self.others)
        late_enough = bool(self.sound) and self.sound[0].horizon >= self.stages.sound
        failed = tuple(replace(each, failed_s=each.failed_s or self.horizon) for each in self.sound)
        if late_enough and not fine and not wavers:
            earlier = settled(self.plain, self.sound[0].horizon, SLOPES)
            if earlier.ratio > _FAILED_BY_THEN * min(each.ratio for each in self.sound):
                self.plain, self.others = earlier, list(failed)
                self.horizon = earlier.horizon
                return True
        self.sound = tuple(self.others) if fine else failed if wavers else ()
        return False

    def _given_up(self, least: float, searched: bool) -> bool:
        """True where nothing explains the contacts so far, and nothing will explain later ones.

        `least` is the best ratio, `searched` says that causes were sought at this horizon.
        """
        self.lost = self.lost + 1 if least > _LOST else 0
        if self.horizon > self.stages.followed:
            return self.lost > 0
        none_left = not self.search.may_ask(self.best)
        # once both ends have touched, a search beside the best cause is the last word, and so is none that is left
        in_vain = self.horizon >= self.stages.touched and (none_left or (searched and bool(self.best.causes)))
        enough = 1 if in_vain else _LOST_HORIZONS
        return self.lost >= enough or (none_left and least > LITTLE_EXPLAINED and self.horizon >= self.stages.bounced)


def decided(plain: Contender, field: Sequence[Contender], horizon: float) -> bool:
    """True where one model leaves noise alone and no other with causes comes near: it goes on alone beside the plain one."""
    ranked = sorted((each for each in [plain, *field] if each.horizon == horizon), key=lambda each: each.bic)
    if not ranked or not ranked[0].causes or ranked[0].fails_beside(plain):
        return False
    rivals = [each for each in ranked[1:] if each.effects != ranked[0].effects]
    return all(each.bic > ranked[0].bic + AHEAD + _DOUBT * ranked[0].excess for each in rivals)


def _kept(field: Sequence[Contender]) -> list[Contender]:
    """Return the contenders that go on: the best, and those not far behind."""
    ranked = sorted(field, key=lambda each: each.bic)[:_CONTENDERS]
    return [each for each in ranked if each.ratio < _BEHIND * ranked[0].ratio]


def _refitted(field: Sequence[Contender], horizon: float) -> list[Contender]:
    """Return the contenders fitted to a horizon, the leader with most care."""
    out = []
    for place, each in enumerate(sorted(field, key=lambda each: each.bic)):
        try:
            out.append(weighed(settled(each, horizon, SLOPES if place == 0 else FEW_SLOPES)))
        except InputError:
            continue
    return out
