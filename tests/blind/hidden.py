"""Hidden effects: how they are declared, drawn and applied.

An effect is a function that changes the true machine or its sensors, declared with another that draws its place and
sizes (`level` from 0, weak, to 1, strong; sizes grow with it logarithmically).  Parameters are in SI, have their unit as
suffix, and the catalogue's names where they mean the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.blind.sensors import Sensors
from tests.blind.truth import Truth, rotor_modes

Rng = np.random.Generator
Values = dict[str, float]


@dataclass(frozen=True)
class World:
    """The true machine, its sensors, and where the keyphasor's mark sits at each drop."""

    truth: Truth
    sensors: Sensors
    marks: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Hidden:
    """An effect at a place with its parameters, SI (unit as suffix)."""

    name: str
    where: str
    parameters: Values


Draw = Callable[[Rng, World, float], tuple[str, Values]]  # level to place and parameters
Apply = Callable[[World, Hidden], World]
EFFECTS: dict[str, tuple[Draw, Apply]] = {}

ENDS = ("NDE", "DE")


def effect(draw: Draw) -> Callable[[Apply], Apply]:
    """Declare an effect with the function that draws it."""

    def keep(apply: Apply) -> Apply:
        EFFECTS[apply.__name__] = (draw, apply)
        return apply

    return keep


def between(level: float, low: float, high: float) -> float:
    """Return the size at a level between two sizes, logarithmically."""
    return float(low * (high / low) ** level)


def length(world: World, level: float, low: float, high: float) -> float:
    """Return the length at a level between two lengths, which are given for a gap of 250 um."""
    return between(level, low, high) * world.truth.machine.touchdowns[0].gap.nominal / 250e-6


def weight(world: World) -> float:
    """Return the rotor's weight, N."""
    return rotor_modes(world.truth).mass * 9.80665


def an_end(rng: Rng) -> str:
    """Draw an end."""
    return str(rng.choice(ENDS))


def an_end_or_both(rng: Rng) -> str:
    """Draw an end, or both."""
    return str(rng.choice(("NDE", "DE", "both")))


def an_angle(rng: Rng) -> float:
    """Draw an angle, rad."""
    return float(rng.uniform(-np.pi, np.pi))


def a_sign(rng: Rng) -> float:
    """Draw a sign."""
    return float(rng.choice((-1.0, 1.0)))


def a_probe(rng: Rng, world: World) -> str:
    """Draw a probe."""
    return str(rng.choice([p.name for p in world.truth.machine.probes]))


def a_plane(rng: Rng, world: World) -> str:
    """Draw an unbalance plane."""
    return str(rng.choice([p.name for p in world.truth.machine.planes]))


def at_bearings(world: World, where: str, **values: Any) -> World:
    """Return the world with other values at an end or both."""
    nde, de = (
        b._replace(**values) if where in (end, "both") else b for end, b in zip(ENDS, world.truth.bearings, strict=True)
    )
    return replace(world, truth=replace(world.truth, bearings=(nde, de)))


def at_probe(values: tuple[float, ...], world: World, where: str, value: float) -> tuple[float, ...]:
    """Return the probes' values with that of one probe replaced."""
    return tuple(value if p.name == where else v for p, v in zip(world.truth.machine.probes, values, strict=True))
