"""Hidden effects of the instruments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.blind.hidden import (
    ENDS,
    Hidden,
    Rng,
    Values,
    World,
    a_probe,
    a_sign,
    an_angle,
    an_end,
    at_probe,
    between,
    effect,
    length,
)


@effect(lambda rng, w, level: (a_probe(rng, w), {"gain": 1 + a_sign(rng) * between(level, 0.01, 0.15)}))
def probe_gain(world: World, h: Hidden) -> World:
    """The channel reads `gain` times the displacement from the bearing's centre."""
    gain = at_probe(world.sensors.gain, world, h.where, h.parameters["gain"])
    return replace(world, sensors=replace(world.sensors, gain=gain))


@effect(lambda rng, w, level: (a_probe(rng, w), {"error_rad": a_sign(rng) * np.radians(between(level, 0.7, 15))}))
def probe_angle(world: World, h: Hidden) -> World:
    """The probe stands further towards +y by the error."""
    turned = at_probe(world.sensors.turned, world, h.where, h.parameters["error_rad"])
    return replace(world, sensors=replace(world.sensors, turned=turned))


def _draw_runout(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    first = length(world, level, 1.5e-6, 25e-6)
    return (
        an_end(rng),
        {
            "first_m": first,
            "first_phase_rad": an_angle(rng),
            "second_m": first * float(rng.uniform(0.1, 0.8)),
            "second_phase_rad": an_angle(rng),
        },
    )


@effect(_draw_runout)
def probe_runout(world: World, h: Hidden) -> World:
    """Runout of the surface under an end's probes, on top of the usual: a_k cos(k (point - phase_k))."""
    p, end = h.parameters, ENDS.index(h.where)
    runout = list(world.sensors.runout)
    first, second, third = runout[end]
    first += p["first_m"] * np.exp(-1j * p["first_phase_rad"])
    second += p["second_m"] * np.exp(-2j * p["second_phase_rad"])
    runout[end] = (first, second, third)
    return replace(world, sensors=replace(world.sensors, runout=tuple(runout)))


@effect(
    lambda rng, w, level: (
        an_end(rng),
        {"factor": a_sign(rng) * between(level, 0.01, 0.2), "into": float(rng.integers(0, 2))},
    )
)
def probe_crosstalk(world: World, h: Hidden) -> World:
    """A factor of the end's other channel adds to its channel A (`into` 0) or B (1)."""
    leak = list(world.sensors.leak)
    leak[2 * ENDS.index(h.where) + int(h.parameters["into"])] = h.parameters["factor"]
    return replace(world, sensors=replace(world.sensors, leak=tuple(leak)))


@effect(lambda rng, w, level: (a_probe(rng, w), {"delay_s": round(between(level, 1, 50)) / 20e3}))
def channel_lag(world: World, h: Hidden) -> World:
    """The channel is late by a whole number of samples."""
    late = at_probe(world.sensors.late, world, h.where, h.parameters["delay_s"])
    return replace(world, sensors=replace(world.sensors, late=late))
