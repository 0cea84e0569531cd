"""Ways out of a wrong minimum: what is tried with the best model where it fails, or hardly holds, at a horizon."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum, auto

from tdbmon.diagnosis.attempt import from_the_fall_or_none
from tdbmon.diagnosis.begun_anew import (
    at_other_angles,
    at_other_sizes,
    by_one_alike,
    in_neighbouring_orders,
    neighbours,
    of_any_kind,
)
from tdbmon.diagnosis.contender import NEARLY, Contender
from tdbmon.diagnosis.search import Search
from tdbmon.diagnosis.suspects import Suspect, alike_at_other_ends, alike_but_for_the_law
from tdbmon.identify.clearances import better_clearances, hardly_gained, led_along
from tdbmon.identify.draws import shaken
from tdbmon.identify.follow import FAILING
from tdbmon.identify.own_paths import best_paths

# times the noise that the best model leaves: what is missing is hardly another size or order of the same
LITTLE_EXPLAINED = 1.8
_NEAR_NOISE = 1.5  # times the floor: who leaves less may be in a wrong hollow rather than wrong


class Way(Enum):
    """A way out."""

    VALLEY = auto()  # along the valley of the clearances
    ENDS = auto()  # a cause of one end at both
    ANGLES = auto()
    SIZES = auto()
    ORDERS = auto()  # neighbouring ones
    KINDS = auto()  # balls, waves and lobes in each other's place
    EXCHANGED = auto()  # the last cause for another
    LAWS = auto()  # another law of a cause
    STATED = auto()  # what the machine file states without tolerance let free
    FURTHER = auto()  # one more cause, where little is left


@dataclass
class WaysOut:
    """The ways out, and which of them were tried.

    Attributes
    ----------
    search : Search
    tried : set of tuple
        Those that would come to the same again: each `Way`, and the model, cause or bearing that it was tried with.
    other_kinds : bool
        Whether it may still help to try balls, waves and lobes in each other's place.
    """

    search: Search
    tried: set[tuple[object, ...]] = field(default_factory=set)
    other_kinds: bool = True

    def untried(self, way: Way, *of: object) -> bool:
        """Return whether a way was not yet tried with something; from then on it was."""
        new = (way, *of) not in self.tried
        self.tried.add((way, *of))
        return new

    def deepened(self, best: Contender, plain: Contender, *, held: bool, decided: bool) -> Contender:
        """Return a model led out of a wrong minimum, if it is in one.

        Parameters
        ----------
        best : Contender
            The leader at its horizon; it may be the plain model.
        plain : Contender
        held : bool
            Whether a model with a cause left noise alone at an earlier horizon.
        decided : bool
            Whether it goes on alone.
        """
        stages, horizon = self.search.stages, best.horizon
        if horizon > stages.sound and best.fails_with_causes(plain) and best.fits_much:
            # what fits a little of anything for a while is of another kind or order more often than in a wrong hollow
            best = self.of_any_kind(best, plain)
        best = self._by_ones_alike(best, plain, Way.LAWS, alike_but_for_the_law)
        best = self._by_ones_alike(best, plain, Way.ENDS, alike_at_other_ends)
        if horizon == self.search.last:
            best = self._again_from_the_fall(best)
        # where only little is left, a wrong clearance is likelier than a cause, and looks like waves of many orders
        if horizon == stages.touched or (self._may_be_led(best, decided) and _nearly_holds(best)):
            best = replace(best, fit=better_clearances(best.problem, best.fit, horizon))
        if horizon >= stages.bounced and self._may_be_led(best, decided) and _nearly_holds(best):  # still
            led = led_along(best.problem, best.fit, horizon)
            if hardly_gained(best.fit, led, best.floor * best.fit.count):
                self.tried.add((Way.VALLEY, best.name))
            best = replace(best, fit=led)
        if horizon <= stages.sound:
            best = self._at_other_sizes(best, plain)
        if not best.fails_with_causes(plain):
            return best
        sought = best_paths(best.problem, best.fit, horizon)
        best = replace(best, fit=shaken(best.problem, sought, horizon))
        best = self._at_other_sizes(self._at_other_angles(best, plain), plain)
        if horizon > stages.sound:
            best = self._in_neighbouring_orders(best, plain)
            # a wrong order holds for a while; that it did is no witness before the others were asked
            if (held and best.fails_beside(plain)) or best.ratio > LITTLE_EXPLAINED:
                best = self.of_any_kind(best, plain)
        return best

    def by_better_laws(self, best: Contender) -> Contender:
        """Return a model, or the best with causes in contacts by other laws of theirs, which few contacts hardly tell apart."""
        for cause in best.causes:
            others = [each for each in self.search.suspects if alike_but_for_the_law(each, cause)]
            if cause.in_contacts and others and self.untried(Way.LAWS, cause.name, best.name):
                self.search.progress(f"fitting {cause.words} by other laws")
                best = by_one_alike(self.search.fallen, best, cause, others, self.search.horizons)
        return best

    def of_any_kind(self, best: Contender, plain: Contender) -> Contender:
        """Return a model, or the best with other waves, lobes or balls of the bearing in the place of its own."""
        cause, search = best.much_fitting, self.search
        if cause is None or search.began > search.stages.sound or not self.other_kinds:
            return best
        early = best.horizon <= search.stages.sound
        if not self.untried(Way.KINDS, cause.where, early):
            return best
        anew = of_any_kind(
            search.fallen, best, cause, search.suspects, search.horizons, first_contact_fits=search.first_contact_fits
        )
        if early and anew.fails_beside(plain) and any(each.many_valued for each in best.causes):
            again = of_any_kind(search.fallen, best, cause, search.suspects, search.horizons, afresh=True)
            anew = min(anew, again, key=lambda each: each.misfit)
        # where none of them leaves noise alone, what is missing is of another kind
        self.other_kinds = not anew.fails_beside(plain)
        return anew

    def _again_from_the_fall(self, best: Contender) -> Contender:
        """Return a model, or one with causes that fails followed from the fall on once more, with these as they are known now.

        Where a cause was found its size was rough, and the machine's values that made up for that came along since.
        """
        if not best.causes or not best.fails or best.ratio > NEARLY:
            return best
        horizons = [h for h in self.search.horizons if h <= best.horizon]
        return from_the_fall_or_none(self.search.fallen, best, horizons) or best

    def _by_ones_alike(
        self, best: Contender, plain: Contender, way: Way, alike: Callable[[Suspect, Suspect], bool]
    ) -> Contender:
        """Return a model, or the best with what looks like one of its causes in the place of that."""
        for cause in best.causes:
            if best.fails_with_causes(plain) and self.untried(way, cause.name, best.name):
                others = [each for each in self.search.suspects if alike(each, cause)]
                best = by_one_alike(self.search.fallen, best, cause, others, self.search.horizons) if others else best
        return best

    def _at_other_angles(self, best: Contender, plain: Contender) -> Contender:
        """Return a model, or the best with its last cause begun at other angles."""
        if best.causes[-1].lies and best.fails_beside(plain) and self.untried(Way.ANGLES, best.name):
            return at_other_angles(self.search.fallen, best, self.search.horizons)
        return best

    def _at_other_sizes(self, best: Contender, plain: Contender) -> Contender:
        """Return a model, or the best with one of its causes that have several values begun at other sizes."""
        stages, horizon = self.search.stages, best.horizon
        early = horizon <= stages.sound  # what is left there is seldom a law that is a little off
        for cause in best.causes if horizon > stages.touched else ():
            fails = best.fails if early else best.fails_beside(plain)
            if cause.many_valued and fails and self.untried(Way.SIZES, cause.name, best.name):
                best = at_other_sizes(self.search.fallen, best, cause, self.search.horizons)
        return best

    def _in_neighbouring_orders(self, best: Contender, plain: Contender) -> Contender:
        """Return a model, or the best with waves or lobes of a neighbouring order in the place of its own."""
        cause = best.much_fitting
        if cause is None or not best.fails_beside(plain) or (Way.ORDERS, cause) in self.tried:
            return best
        near = neighbours(cause, self.search.suspects)
        self.tried |= {(Way.ORDERS, each) for each in (cause, *near)}
        return in_neighbouring_orders(self.search.fallen, best, cause, near, self.search.horizons)

    def _may_be_led(self, best: Contender, decided: bool) -> bool:
        """True where leading a model along the valley of the clearances may still decide something."""
        stages = self.search.stages
        return (
            stages.touched < best.horizon <= stages.followed
            and (Way.VALLEY, best.name) not in self.tried
            and not decided
        )


def _nearly_holds(best: Contender) -> bool:
    """True where a model fails in a drop at least, and leaves so little in all that it may be in a wrong hollow.

    One with causes must fail in all: sizes and orders are never quite right.
    """
    if best.ratio > _NEAR_NOISE * best.floor or (best.causes and not best.fails):
        return False
    return max(best.fit.ratio_of_drops) > FAILING * best.floor
