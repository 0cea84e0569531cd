"""All that can be hidden: the catalogue's effects, and those that it lacks (their names begin with x_)."""

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
    """Names of the effects that the catalogue lacks."""
    return tuple(name for name in EFFECTS if name.startswith("x_"))


def draw(name: str, rng: Rng, world: World, level: float) -> Hidden:
    """Return place and parameters of an effect of a level between 0 (weak) and 1 (strong)."""
    where, parameters = EFFECTS[name][0](rng, world, level)
    return Hidden(name, where, parameters)


def apply(world: World, hidden: Hidden) -> World:
    """Return the world with the effect in it."""
    return EFFECTS[hidden.name][1](world, hidden)
