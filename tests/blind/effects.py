"""All effects that can be hidden: those of the catalogue, and those outside it (their names begin with x_)."""

from __future__ import annotations

import tests.blind.bearing_effects
import tests.blind.outside_effects
import tests.blind.rotor_effects
import tests.blind.sensor_effects  # noqa: F401
from tests.blind.hidden import EFFECTS, Hidden, Rng, World


def names() -> tuple[str, ...]:
    """Names of the catalogue's effects."""
    return tuple(name for name in EFFECTS if not name.startswith("x_"))


def outside() -> tuple[str, ...]:
    """Names of the effects outside the catalogue."""
    return tuple(name for name in EFFECTS if name.startswith("x_"))


def draw(name: str, rng: Rng, world: World, level: float) -> Hidden:
    """Return an effect at a level between 0 (weak) and 1 (strong), with place and parameters drawn."""
    where, parameters = EFFECTS[name][0](rng, world, level)
    return Hidden(name, where, parameters)


def apply(world: World, hidden: Hidden) -> World:
    """Return the world with the effect in it."""
    return EFFECTS[hidden.name][1](world, hidden)
