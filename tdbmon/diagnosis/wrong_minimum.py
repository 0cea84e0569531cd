"""Ways out of a wrong minimum, tried with the leader where it fails, or hardly holds, at a horizon."""

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

# misfit ratio of the leader above which another size or order of the same cause hardly helps
LITTLE_EXPLAINED = 1.8
_NEAR_NOISE = 1.5  # times the floor: a model that leaves less may be in a wrong minimum rather than wrong


class Way(Enum):
    """A way out."""

    VALLEY = auto()  # along the valley of the clearances
    ENDS = auto()  # a cause at both ends in the place of one end, or the reverse
    ANGLES = auto()
    SIZES = auto()
    ORDERS = auto()  # neighbouring ones
    KINDS = auto()  # balls, waves and lobes in each other's place
    EXCHANGED = auto()  # another cause in the place of the last
    LAWS = auto()  # another law of a cause
    STATED = auto()  # values stated without tolerance freed
    FURTHER = auto()  # one more cause, where little is left


@dataclass
class WaysOut:
    """The ways out, and which of them were tried.

    Attributes
    ----------
    search : Search
    tried : set of tuple
        Each `Way` tried, with its model, cause or bearing; a repetition would give the same result.
    other_kinds : bool
        Whether balls, waves and lobes in each other's place may still help.
    """

    search: Search
    tried: set[tuple[object, ...]] = field(default_factory=set)
    other_kinds: bool = True

    def untried(self, way: Way, *of: object) -> bool:
        """True if a way was not yet tried with these; marks it as tried."""
        new = (way, *of) not in self.tried
        self.tried.add((way, *of))
        return new

    def deepened(self, best: Contender, plain: Contender, *, held: bool, decided: bool) -> Contender:
        """Return the model, led out of a wrong minimum if it is in one.

        Parameters
        ----------
        best : Contender
            The leader at its horizon; it may be the plain model.
        plain : Contender
        held : bool
            Whether a model with a cause held at an earlier horizon.
        decided : bool
            Whether the model has won and goes on alone.
        """
        stages, horizon = self.search.stages, best.horizon
        if horizon > stages.sound and best.fails_with_causes(plain) and best.fits_much:
            # waves, lobes or a ball that held for a while are more often of the wrong kind or order than in a wrong minimum
            best = self.of_any_kind(best, plain)
        best = self._by_look_alikes(best, plain, Way.LAWS, alike_but_for_the_law)
        best = self._by_look_alikes(best, plain, Way.ENDS, alike_at_other_ends)
        if horizon == self.search.last:
            best = self._again_from_the_fall(best)
        # where little is left, a wrong clearance is likelier than a cause, and looks like waves of many orders
        if horizon == stages.touched or (self._may_be_led(best, decided) and _nearly_holds(best)):
            best = replace(best, fit=better_clearances(best.problem, best.fit, horizon))
        if horizon >= stages.bounced and self._may_be_led(best, decided) and _nearly_holds(best):  # still so
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
            # a wrong order may hold for a while; before others are tried that is no evidence for it
            if (held and best.fails_beside(plain)) or best.ratio > LITTLE_EXPLAINED:
                best = self.of_any_kind(best, plain)
        return best

    def by_better_laws(self, best: Contender) -> Contender:
        """Return the best of the model and the same with other laws of its contact causes, alike at the first few contacts."""
        for cause in best.causes:
            others = [each for each in self.search.suspects if alike_but_for_the_law(each, cause)]
            if cause.in_contacts and others and self.untried(Way.LAWS, cause.name, best.name):
                self.search.progress(f"fitting {cause.words} with other laws")
                best = by_one_alike(self.search.fallen, best, cause, others, self.search.horizons)
        return best

    def of_any_kind(self, best: Contender, plain: Contender) -> Contender:
        """Return the best of the model and the same with other waves, lobes or balls of the bearing in the place of its own."""
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
        # if none of them holds, the missing cause is something else
        self.other_kinds = not anew.fails_beside(plain)
        return anew

    def _again_from_the_fall(self, best: Contender) -> Contender:
        """Return the model, or a failing one with causes fitted from the fall on once more, starting from their present values.

        A cause's size was rough when it was found, and the machine's values have compensated for that since.
        """
        if not best.causes or not best.fails or best.ratio > NEARLY:
            return best
        horizons = [h for h in self.search.horizons if h <= best.horizon]
        return from_the_fall_or_none(self.search.fallen, best, horizons) or best

    def _by_look_alikes(
        self, best: Contender, plain: Contender, way: Way, alike: Callable[[Suspect, Suspect], bool]
    ) -> Contender:
        """Return the best of the model and the same with look-alikes in the place of its causes, while it fails."""
        for cause in best.causes:
            if best.fails_with_causes(plain) and self.untried(way, cause.name, best.name):
                others = [each for each in self.search.suspects if alike(each, cause)]
                best = by_one_alike(self.search.fallen, best, cause, others, self.search.horizons) if others else best
        return best

    def _at_other_angles(self, best: Contender, plain: Contender) -> Contender:
        """Return the best of the model and the same with its last cause started at other angles."""
        if best.causes[-1].lies and best.fails_beside(plain) and self.untried(Way.ANGLES, best.name):
            return at_other_angles(self.search.fallen, best, self.search.horizons)
        return best

    def _at_other_sizes(self, best: Contender, plain: Contender) -> Contender:
        """Return the best of the model and the same with its many-valued causes started at other sizes."""
        stages, horizon = self.search.stages, best.horizon
        early = horizon <= stages.sound  # an excess there is seldom due to an inexact law
        for cause in best.causes if horizon > stages.touched else ():
            fails = best.fails if early else best.fails_beside(plain)
            if cause.many_valued and fails and self.untried(Way.SIZES, cause.name, best.name):
                best = at_other_sizes(self.search.fallen, best, cause, self.search.horizons)
        return best

    def _in_neighbouring_orders(self, best: Contender, plain: Contender) -> Contender:
        """Return the best of the model and the same with waves or lobes of a neighbouring order in the place of its own."""
        cause = best.much_fitting
        if cause is None or not best.fails_beside(plain) or (Way.ORDERS, cause) in self.tried:
            return best
        near = neighbours(cause, self.search.suspects)
        self.tried |= {(Way.ORDERS, each) for each in (cause, *near)}
        return in_neighbouring_orders(self.search.fallen, best, cause, near, self.search.horizons)

    def _may_be_led(self, best: Contender, decided: bool) -> bool:
        """True if a fit along the valley of the clearances may still decide something."""
        stages = self.search.stages
        return (
            stages.touched < best.horizon <= stages.followed
            and (Way.VALLEY, best.name) not in self.tried
            and not decided
        )


def _nearly_holds(best: Contender) -> bool:
    """True if a model leaves so little that it may be in a wrong minimum, but fails in at least one drop.

    A model with causes must also fail over all drops together: sizes and orders are never quite right.
    """
    if best.ratio > _NEAR_NOISE * best.floor or (best.causes and not best.fails):
        return False
    return max(best.fit.ratio_of_drops) > FAILING * best.floor
