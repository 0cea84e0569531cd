"""The effects that a model could lack: every effect of the catalogue, at every place of the machine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
from tdbsim.effect import Effect, EffectDeclaration, Place, catalogue, places
from tdbsim.effect import Parameter as Declared
from tdbsim.machine import Machine, Probe

from tdbmon.diagnosis.effect_size import nearer
from tdbmon.identify.free_effect import FreeEffect, PlacedEffect

# orders of waves and lobes; order 1 is an eccentric ring, which with a phase per drop fits anything that drifts
_LOWEST_ORDER, _HIGHEST_ORDER = 2, 6


@dataclass(frozen=True, eq=False)
class Suspect(PlacedEffect):
    """An effect at a place, tried as a cause; `held` are the words, whole numbers and barely determined values it is tried with.

    Attributes
    ----------
    sizes : tuple of pair
        Parameters that switch the effect on, each with its angle, or None.
    """

    sizes: tuple[tuple[Declared, Declared | None], ...]

    @property
    def tried_with(self) -> str:
        """Its held values as text."""
        return ", ".join(self.declared.texts(self.held))

    @property
    def counted(self) -> Declared | None:
        """The whole number that differs from drop to drop, if there is one."""
        return next((p for p in self.declared.parameters if p.whole and p.per_drop), None)

    @property
    def shapes(self) -> tuple[Declared, ...]:
        """The free parameters beside sizes and angles."""
        known = {p.name for pair in self.sizes for p in pair if p is not None}
        return tuple(
            p
            for p in self.declared.parameters
            if p.name not in known and p.name not in self.held and not (p.whole and p.per_drop)
        )

    @property
    def angles(self) -> tuple[Declared, ...]:
        """The angles of its sizes."""
        return tuple(angle for _, angle in self.sizes if angle is not None)

    @property
    def usual_values(self) -> dict[str, float]:
        """The free parameters except angles, at their usual size (SI, by name)."""
        return {p.name: p.typical for p in (*self.shapes, *(size for size, _ in self.sizes))}

    @property
    def in_contacts(self) -> bool:
        """True if the effect acts only while shaft and bearing touch."""
        return self.declared.place in (Place.BEARING, Place.BEARING_OR_BOTH)

    @property
    def turning(self) -> bool:
        """True if the effect turns with a ring, so that its phase differs from drop to drop."""
        return self.in_contacts and any(angle.per_drop for angle in self.angles)

    @property
    def standing_waves(self) -> bool:
        """True for waves of a race that does not turn; the cage angles determine which balls meet them."""
        counted = any(p.whole and p.name in self.held for p in self.declared.parameters)
        return counted and self.in_contacts and not self.turning

    @property
    def lies(self) -> bool:
        """True for a contact cause with a direction common to all drops: an oval, an anisotropic support."""
        return bool(self.usual()) and not self.standing_waves and bool(self.angles)

    @property
    def many_valued(self) -> bool:
        """True for a contact cause with further values common to all drops beside its size: a foundation, a loose support."""
        return bool(self.usual()) and bool(self.shapes)

    @property
    def drop_specific(self) -> bool:
        """True for lobes, turning waves and balls, which have an angle or a number of their own in every drop."""
        return self.turning or self.counted is not None

    @property
    def fits_much(self) -> bool:
        """True for a ball, waves or lobes: with their many orders, numbers and angles they fit a little of anything."""
        return self.drop_specific or self.standing_waves

    def usual(self) -> tuple[Start, ...]:
        """Return start points of a contact cause at its usual size, with angles at quarters of their period.

        None if it is drop-specific.  Values to which the gradient does not lead are start points too
        (`tdbsim.effect.Parameter.further`).
        """
        shared, angles = self.usual_values, self.angles
        if not self.in_contacts or self.drop_specific:
            return ()
        if not angles:
            return (Start(shared), *(Start(shared | {p.name: value}) for p in self.shapes for value in p.further))
        quarters = np.arange(4) * math.pi / 2
        return tuple(Start(shared | {a.name: float(quarter / a.harmonic) for a in angles}) for quarter in quarters)

    def smaller(self, start: Start, share: float) -> Start:
        """Return the start point with its sizes reduced to a share, counted from where the effect is off."""
        sizes = {size.name: nearer(size, start.shared[size.name], share) for size, _ in self.sizes}
        return replace(start, shared={**start.shared, **sizes})

    def effect(self, values: Mapping[str, float]) -> Effect:
        """Return the effect with the given values (SI); other sizes are off, other shapes typical."""
        usual = {p.name: p.typical for p in self.shapes}
        rest = {size.name: size.off for size, _ in self.sizes if size.name not in values}
        return self.declared.kind(self.where, **{**usual, **rest, **self.held, **values})


@dataclass(frozen=True, eq=False)
class Start:
    """Start point of a suspect's fit (SI): values common to all drops, and those of each.

    `known` are prior standard deviations of some of the common ones, from data outside the fit.
    """

    shared: Mapping[str, float]
    each: tuple[Mapping[str, float], ...] = ()
    each_held: tuple[Mapping[str, float], ...] = field(default=())
    known: Mapping[str, float] = field(default_factory=dict)

    def free(self, suspect: Suspect) -> FreeEffect:
        """Return the suspect as an effect with free parameters."""
        return FreeEffect(
            suspect.declared, suspect.where, suspect.held, self.shared, self.each, self.each_held, self.known
        )


def alike_at_first_contact(one: Suspect, other: Suspect) -> bool:
    """True for waves, lobes and balls at one bearing, which the first contact hardly tells apart."""
    return one.where == other.where and one.fits_much and other.fits_much


def alike_at_other_ends(one: Suspect, other: Suspect) -> bool:
    """True for the same effect at one end and at both, which the end that shows it hardly tells apart."""
    return _alike_elsewhere(one, other) and "both" in (one.where, other.where)


def may_act_at_both_ends(one: Suspect, other: Suspect) -> bool:
    """True for the same effect at either end, if it can also act at both ends alike."""
    either = _alike_elsewhere(one, other) and "both" not in (one.where, other.where)
    return either and one.declared.place is Place.BEARING_OR_BOTH


def _alike_elsewhere(one: Suspect, other: Suspect) -> bool:
    return one.declared is other.declared and one.held == other.held and one.where != other.where


def alike_but_for_the_law(one: Suspect, other: Suspect) -> bool:
    """True for the same effect with other laws (words of its declaration) and the same angles; not for waves, lobes or balls."""
    same = one.declared.identifier == other.declared.identifier and one.where == other.where and not one.fits_much
    apart = {name for name in one.held if one.held[name] != other.held[name]} if same else set()
    return bool(apart) and all(isinstance(one.held[name], str) for name in apart) and one.angles == other.angles


def suspects(machine: Machine, probes: Sequence[Probe], standing: Sequence[Effect]) -> tuple[Suspect, ...]:
    """Return the effects that a machine's model could lack.

    Parameters
    ----------
    machine : Machine
    probes : sequence of Probe
        Those in use; effects on other probes are left out.
    standing : sequence of Effect
        Effects in the model already; they are left out at their places.
    """
    taken = {(each.identifier(), place) for each in standing for place in each.standing_places(machine)}
    found = []
    for declared in catalogue():
        if not declared.kind.can_act(machine):
            continue
        for where in places(declared.place, machine):
            stands = {(declared.identifier, place) for place in declared.kind(where).standing_places(machine)}
            if stands & taken or not _seen(declared, where, probes):
                continue
            found += [Suspect(declared, where, held, _sizes(declared, held)) for held in _held(declared)]
    return tuple(found)


def _seen(declared: EffectDeclaration, where: str, probes: Sequence[Probe]) -> bool:
    if declared.place is Place.PROBE:
        return where in {probe.name for probe in probes}
    if declared.place is Place.END:
        return sum(probe.end == where for probe in probes) >= 2
    return True


def _held(declared: EffectDeclaration) -> Iterator[dict[str, float | str]]:
    """Yield every combination of words and whole numbers; values that are never fitted stay off."""
    names, ranges = [], []
    for p in declared.parameters:
        if p.held:
            names.append(p.name)
            ranges.append([p.off])
        elif p.choices:
            names.append(p.name)
            ranges.append(list(p.choices))
        elif p.whole and not p.per_drop:
            names.append(p.name)
            orders = range(max(int(p.low), _LOWEST_ORDER), min(int(p.high), _HIGHEST_ORDER) + 1)
            ranges.append([float(order) for order in orders])
    for values in product(*ranges):
        yield dict(zip(names, values, strict=True))


def _sizes(
    declared: EffectDeclaration, held: Mapping[str, float | str]
) -> tuple[tuple[Declared, Declared | None], ...]:
    """Return the parameters that switch an effect on, each with the angle declared after it."""
    fixed, parameters = declared.kind.stands_still(held), declared.parameters
    sizes: list[tuple[Declared, Declared | None]] = []
    last = parameters[0]
    for p in parameters:
        if p.off == 0.0 and not p.goes_round:
            last = p
        elif p.goes_round:
            sizes.append((last, replace(p, per_drop=p.per_drop and not fixed)))
    return tuple(sizes) or ((parameters[0], None),)
