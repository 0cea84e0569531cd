"""An effect of the catalogue at a place, with parameters free in a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from tdbsim.effect import Effect, EffectDeclaration, declaration

from tdbmon.identify.parameters import Parameter

_ANGLE_SPAN = 0.5  # rad


def place_in_words(where: str) -> str:
    """Return the place of an effect in words."""
    return {"both": "both ends", "rotor": "the rotor"}.get(where, where)


def effect_in_words(effect: Effect) -> str:
    """Return an effect with its place and values in words."""
    declared = declaration(effect.identifier())
    values = declared.texts(effect.values)
    return f"{declared.title} at {place_in_words(effect.where)} ({', '.join(values)})"


@dataclass(frozen=True, eq=False)
class PlacedEffect:
    """An effect at a place.

    Attributes
    ----------
    declared : EffectDeclaration
    where : str
    held : mapping
        Fixed parameters, SI or a word.
    """

    declared: EffectDeclaration
    where: str
    held: Mapping[str, float | str]

    @property
    def name(self) -> str:
        """Identifier and place, as in results."""
        return f"{self.declared.identifier}@{self.where}"

    @property
    def words(self) -> str:
        """Effect and place in words."""
        return f"{self.declared.title} at {place_in_words(self.where)}"


@dataclass(frozen=True, eq=False)
class FreeEffect(PlacedEffect):
    """An effect whose parameters are fitted except those held, as shared or as per-drop parameters.

    Attributes
    ----------
    start : mapping
        Starting values of the shared parameters, SI.
    each_start : tuple of mapping
        Starting values of the per-drop parameters, one mapping per drop: for instance the phase of a lobe on the inner ring,
        whose angle at the release is unknown.
    each_held : tuple of mapping
        Fixed per-drop parameters: the number of a ball, counted from the cage's angle.
    known : mapping
        Prior standard deviations (SI) of some shared parameters about their starting values.
    """

    start: Mapping[str, float]
    each_start: tuple[Mapping[str, float], ...] = ()
    each_held: tuple[Mapping[str, float], ...] = ()
    known: Mapping[str, float] = field(default_factory=dict)

    @property
    def shared(self) -> tuple[Parameter, ...]:
        """The shared parameters of the fit."""
        return tuple(self._parameter(name, value) for name, value in self.start.items())

    def own(self, drop: int) -> tuple[Parameter, ...]:
        """Return the per-drop parameters of one drop."""
        if not self.each_start:
            return ()
        return tuple(self._parameter(name, value) for name, value in self.each_start[drop].items())

    @property
    def of_each_drop(self) -> bool:
        """True where the effect has an angle or a number that differs from drop to drop."""
        return bool(self.each_start or self.each_held)

    @property
    def freedom(self) -> int:
        """Number of parameters that it adds to a fit; a per-drop integer counts as one."""
        return len(self.start) + sum(map(len, self.each_start)) + len(self.each_held)

    def _parameter(self, name: str, value: float) -> Parameter:
        of = self.declared.parameter(name)
        full, moves = f"{self.name}.{name}", not self.declared.acts_on_sensors
        if of.goes_round:
            low, high, sigma, span = value - math.pi, value + math.pi, math.inf, _ANGLE_SPAN
        else:
            size = abs(of.typical - of.off) if isinstance(of.off, float) and math.isfinite(of.off) else 0.0
            low, high, sigma, span = of.low, of.high, self.known.get(name, math.inf), size or abs(of.typical)
        return Parameter(full, of.unit, nominal=value, low=low, high=high, sigma=sigma, moves=moves, span=span)

    def at(self, shared: Mapping[str, float], own: Mapping[str, float], drop: int) -> Effect:
        """Return the effect with its parameters at given values of the fit.

        Raises
        ------
        InputError
            If a value is out of bounds.
        """
        given = {name: shared[f"{self.name}.{name}"] for name in self.start}
        if self.each_start:
            given |= {name: own[f"{self.name}.{name}"] for name in self.each_start[0]}
        stays = dict(self.held) | (dict(self.each_held[drop]) if self.each_held else {})
        return self.declared.kind(self.where, **stays, **_wrapped(self.declared, given))


def _wrapped(declared: EffectDeclaration, values: Mapping[str, float]) -> dict[str, float]:
    """Return values with angles wrapped to within half a turn either way."""
    return {
        name: math.remainder(value, 2 * math.pi) if declared.parameter(name).goes_round else value
        for name, value in values.items()
    }
