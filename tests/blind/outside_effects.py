"""Effects outside the catalogue: the right verdict is "unknown"."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.blind.hidden import (
    ENDS,
    Hidden,
    Rng,
    Values,
    World,
    a_plane,
    a_probe,
    a_sign,
    an_angle,
    an_end,
    an_end_or_both,
    at_bearings,
    at_probe,
    between,
    effect,
    length,
    weight,
)


@effect(
    lambda rng, w, level: (
        "rotor",
        {
            "amplitude_m": length(w, level, 3e-6, 25e-6),
            "frequency_hz": float(rng.uniform(25, 160)),
            "direction_rad": an_angle(rng),
            "phase_rad": an_angle(rng),
        },
    )
)
def x_floor_vibration(world: World, h: Hidden) -> World:
    """The ground under both supports shakes."""
    p = h.parameters
    return at_bearings(
        world,
        "both",
        floor_x=p["amplitude_m"] * np.cos(p["direction_rad"]),
        floor_y=p["amplitude_m"] * np.sin(p["direction_rad"]),
        floor_frequency=2 * np.pi * p["frequency_hz"],
        floor_phase=p["phase_rad"],
    )


def _draw_lost_part(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    plane = a_plane(rng, world)
    nominal = next(p.amount.nominal for p in world.truth.machine.planes if p.name == plane)
    return (
        plane,
        {
            "amount_kg_m": nominal * between(level, 4, 15),
            "phase_rad": an_angle(rng),
            "time_s": float(rng.uniform(0.115, 0.2)),
        },
    )


@effect(_draw_lost_part)
def x_sudden_unbalance(world: World, h: Hidden) -> World:
    """A part flies off during every drop."""
    p = h.parameters
    index = [plane.name for plane in world.truth.machine.planes].index(h.where)
    part = p["amount_kg_m"] * np.exp(1j * p["phase_rad"])
    return replace(world, truth=replace(world.truth, late_plane=index, late_unbalance=part, late_time=p["time_s"]))


@effect(
    lambda rng, w, level: (
        a_probe(rng, w),
        {"drift_m": a_sign(rng) * length(w, level, 5e-6, 60e-6), "time_s": float(rng.uniform(0.03, 0.2))},
    )
)
def x_probe_drift(world: World, h: Hidden) -> World:
    """A probe warms up and its zero drifts from the release on."""
    drift = at_probe(world.sensors.drift, world, h.where, h.parameters["drift_m"])
    return replace(world, sensors=replace(world.sensors, drift=drift, drift_time=h.parameters["time_s"]))


@effect(
    lambda rng, w, level: (
        an_end(rng),
        {
            "amplitude_m": length(w, level, 4e-6, 50e-6),
            "frequency_hz": float(rng.uniform(15, 70)),
            "time_s": float(rng.uniform(0.1, 0.5)),
        },
    )
)
def x_axial_motion(world: World, h: Hidden) -> World:
    """The rotor swings axially after the release, under probes that look at a cone."""
    p = h.parameters
    return replace(
        world,
        sensors=replace(
            world.sensors,
            float_end=ENDS.index(h.where),
            float_amplitude=p["amplitude_m"],
            float_frequency=p["frequency_hz"],
            float_time=p["time_s"],
        ),
    )


@effect(lambda rng, w, level: (an_end(rng), {"force_n": between(level, 0.5, 6) * weight(w)}))
def x_cage_fracture(world: World, h: Hidden) -> World:
    """A broken cage knocks the ring outwards once per turn of the cage."""
    return at_bearings(world, h.where, cage_knock=h.parameters["force_n"])


@effect(lambda rng, w, level: (an_end(rng), {"damping_n_s_per_m": between(level, 0.1, 3) * weight(w)}))
def x_fluid_film(world: World, h: Hidden) -> World:
    """Oil in the gap damps the journal against the ring, from the release on."""
    return at_bearings(world, h.where, film=h.parameters["damping_n_s_per_m"])


@effect(
    lambda rng, w, level: (
        an_end(rng),
        {
            "force_n": between(level, 0.15, 1.5) * weight(w),
            "direction_rad": an_angle(rng),
            "time_s": float(rng.uniform(0.105, 0.16)),
            "length_s": float(rng.uniform(0.002, 0.008)),
        },
    )
)
def x_magnet_kick(world: World, h: Hidden) -> World:
    """A magnetic bearing switches on for a moment during every drop."""
    p = h.parameters
    return replace(
        world,
        truth=replace(
            world.truth,
            kick_magnet=ENDS.index(h.where),
            kick_force=p["force_n"] * np.exp(1j * p["direction_rad"]),
            kick_time=p["time_s"],
            kick_length=p["length_s"],
        ),
    )


@effect(lambda rng, w, level: (an_end_or_both(rng), {"force_n": between(level, 0.1, 1.5) * weight(w)}))
def x_support_friction(world: World, h: Hidden) -> World:
    """Dry friction between bearing and housing."""
    return at_bearings(world, h.where, support_friction=h.parameters["force_n"])


@effect(lambda rng, w, level: ("rotor", {"stiffness_n_per_m": between(level, 60, 1000) * weight(w)}))
def x_magnetic_pull(world: World, h: Hidden) -> World:
    """Magnetised iron at the first unbalance plane pulls the rotor along its displacement."""
    position = world.truth.machine.planes[0].position
    stiffness = world.truth.seal_stiffness + h.parameters["stiffness_n_per_m"]
    return replace(world, truth=replace(world.truth, seal_position=position, seal_stiffness=stiffness))


@effect(lambda rng, w, level: ("rotor", {"step_rad": a_sign(rng) * np.radians(between(level, 15, 120))}))
def x_moved_mark(world: World, h: Hidden) -> World:
    """The keyphasor's mark slips on the shaft by a step between drops."""
    return replace(world, marks=tuple(k * h.parameters["step_rad"] for k in range(4)))
