"""What is hidden in the touchdown bearings and their supports."""

from __future__ import annotations

import numpy as np

from tests.blind.hidden import (
    ENDS,
    Hidden,
    Rng,
    Values,
    World,
    an_end,
    an_end_or_both,
    at_bearings,
    between,
    effect,
    length,
    weight,
)


@effect(
    lambda rng, w, level: (
        an_end_or_both(rng),
        {
            "static_excess": between(level, 0.04, 0.35),
            "stribeck_speed_m_per_s": between(float(rng.uniform()), 1.0, 12.0),
        },
    )
)
def stribeck_friction(world: World, h: Hidden) -> World:
    """The coefficient falls with slip speed as a Gaussian; with strange laws, by an exponent between that and an exponential."""
    p = h.parameters
    return at_bearings(world, h.where, friction_excess=p["static_excess"], stribeck_speed=p["stribeck_speed_m_per_s"])


@effect(
    lambda rng, w, level: (
        an_end(rng),
        {"amplitude_m": length(w, level, 2e-6, 40e-6), "angle_rad": float(rng.uniform(0, np.pi))},
    )
)
def oval_clearance(world: World, h: Hidden) -> World:
    """The gap is wider by the amplitude along the angle and narrower across it."""
    return at_bearings(world, h.where, oval=h.parameters["amplitude_m"], oval_angle=h.parameters["angle_rad"])


@effect(
    lambda rng, w, level: (
        an_end(rng),
        {"amplitude_m": length(w, level, 1e-6, 25e-6), "order": float(rng.integers(2, 5))},
    )
)
def ring_out_of_round(world: World, h: Hidden) -> World:
    """Lobes of the bore turn with the ring."""
    return at_bearings(world, h.where, lobe=h.parameters["amplitude_m"], lobe_order=h.parameters["order"])


def _draw_waviness(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    outer = float(rng.integers(0, 2))
    return (
        an_end(rng),
        {"amplitude_m": length(world, level, 0.5e-6, 12e-6), "order": float(rng.integers(2, 7)), "outer_race": outer},
    )


@effect(_draw_waviness)
def race_waviness(world: World, h: Hidden) -> World:
    """A race bulges inwards by a cosine of the azimuth; the inner one turns with the ring."""
    size, outer = h.parameters["amplitude_m"], bool(h.parameters["outer_race"])
    return at_bearings(
        world,
        h.where,
        inner_wave=0.0 if outer else size,
        outer_wave=size if outer else 0.0,
        wave_order=h.parameters["order"],
    )


def _draw_ball(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    ball = int(rng.integers(0, world.truth.bearings[0].balls))
    return (an_end(rng), {"ball": float(ball), "deviation_m": length(world, level, 3e-6, 40e-6)})


@effect(_draw_ball)
def off_sized_ball(world: World, h: Hidden) -> World:
    """One ball is larger in diameter."""
    return at_bearings(world, h.where, odd_ball=int(h.parameters["ball"]), odd_excess=h.parameters["deviation_m"])


@effect(
    lambda rng, w, level: (
        an_end_or_both(rng),
        {
            "ratio": 1 / between(level, 1.15, 5.0),
            "direction_rad": float(rng.choice([0.0, np.pi / 2, rng.uniform(0, np.pi)])),
        },
    )
)
def support_anisotropy(world: World, h: Hidden) -> World:
    """The support is softer along an angle, as stiff as ever across it."""
    return at_bearings(world, h.where, soft_ratio=h.parameters["ratio"], soft_angle=h.parameters["direction_rad"])


@effect(
    lambda rng, w, level: (
        an_end(rng),
        {"play_m": length(w, level, 0.5e-6, 40e-6), "stiffness_ratio": float(rng.uniform(0.02, 0.15))},
    )
)
def loose_support(world: World, h: Hidden) -> World:
    """Within a radial play about its place of rest the support has `stiffness_ratio` of its stiffness."""
    return at_bearings(world, h.where, play=h.parameters["play_m"], play_ratio=h.parameters["stiffness_ratio"])


def _draw_hardening(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    where = an_end_or_both(rng)
    softest = min(b.support_stiffness for e, b in zip(ENDS, world.truth.bearings, strict=True) if where in (e, "both"))
    # ratio of cubic to linear force at the deflection under four rotor weights
    deflection = 4 * weight(world) / softest
    return where, {"cubic_n_per_m3": between(level, 0.01, 2) * softest / deflection**2}


@effect(_draw_hardening)
def hardening_support(world: World, h: Hidden) -> World:
    """Force k u + c u^3, radial."""
    return at_bearings(world, h.where, cubic=h.parameters["cubic_n_per_m3"])


def _draw_foundation(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    mass = world.truth.bearings[0].support_mass * float(rng.uniform(3, 12))
    # the weaker the effect, the stiffer the foundation
    frequency = 2 * np.pi * between(level, 1200, 35)
    stiffness = mass * frequency**2
    damping = 2 * float(rng.uniform(0.02, 0.08)) * mass * frequency
    return (
        an_end_or_both(rng),
        {"mass_kg": mass, "stiffness_n_per_m": stiffness, "damping_n_s_per_m": damping},
    )


@effect(_draw_foundation)
def foundation_mode(world: World, h: Hidden) -> World:
    """The support stands on a mass on a spring and damper, one for each end."""
    p = h.parameters
    return at_bearings(
        world,
        h.where,
        foundation_mass=p["mass_kg"],
        foundation_stiffness=p["stiffness_n_per_m"],
        foundation_damping=p["damping_n_s_per_m"],
    )


def _draw_drag(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    end = an_end(rng)
    nominal = world.truth.machine.touchdowns[ENDS.index(end)].ring_drag.nominal
    return (end, {"torque_n_m": nominal * between(level, 5, 300)})


@effect(_draw_drag)
def ring_drag(world: World, h: Hidden) -> World:
    """Adds to the ring's usual drag."""
    usual = world.truth.bearings[ENDS.index(h.where)].ring_drag
    return at_bearings(world, h.where, ring_drag=usual + h.parameters["torque_n_m"])


@effect(
    lambda rng, w, level: (an_end_or_both(rng), {"growth_m_per_j": length(w, level, 5e-9, 150e-9) * 1000 / weight(w)})
)
def thermal_growth(world: World, h: Hidden) -> World:
    """The gap closes in proportion to the heat of friction in the bearing, which is never lost if no cooling time is given."""
    cooling = h.parameters.get("cooling_time_s", np.inf)
    return at_bearings(world, h.where, growth=h.parameters["growth_m_per_j"], cooling_rate=1 / cooling)
