"""Hidden effects of the rotor and its magnetic bearings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.blind.hidden import Hidden, Rng, Values, World, a_plane, an_angle, between, effect, length
from tests.blind.truth import levitation_growth


@effect(lambda rng, w, level: ("rotor", {"decay_time_s": between(level, 0.2e-3, 4e-3)}))
def residual_magnetic_force(world: World, h: Hidden) -> World:
    """The force at switch-off decays exponentially."""
    return replace(world, truth=replace(world.truth, magnet_decay=h.parameters["decay_time_s"]))


def _draw_unbalance(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    plane = a_plane(rng, world)
    planes = world.truth.machine.planes
    usual, nominal = next(
        (u, p.amount.nominal) for p, u in zip(planes, world.truth.unbalance, strict=True) if p.name == plane
    )
    whole = nominal * between(level, 1.8, 10) * np.exp(1j * an_angle(rng))
    added = whole - usual
    return plane, {
        "amount_kg_m": float(abs(added)),
        "phase_rad": float(np.angle(added)),
        "whole_kg_m": float(abs(whole)),
    }


@effect(_draw_unbalance)
def unbalance(world: World, h: Hidden) -> World:
    """Adds to the plane's own unbalance within its tolerance; the sum exceeds the tolerance."""
    added = h.parameters["amount_kg_m"] * np.exp(1j * h.parameters["phase_rad"])
    planes = world.truth.machine.planes
    new = tuple(u + added if p.name == h.where else u for p, u in zip(planes, world.truth.unbalance, strict=True))
    return replace(world, truth=replace(world.truth, unbalance=new))


@effect(lambda rng, w, level: ("rotor", {"bow_m": length(w, level, 1e-6, 35e-6), "phase_rad": an_angle(rng)}))
def shaft_bow(world: World, h: Hidden) -> World:
    """The unstressed shaft is a parabola, `bow` midway between the touchdown bearings and none at them."""
    return replace(
        world, truth=replace(world.truth, bow=h.parameters["bow_m"] * np.exp(1j * h.parameters["phase_rad"]))
    )


def _draw_cross_coupling(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    plane = a_plane(rng, world)

    def unstable(stiffness: float) -> bool:
        coupled = cross_coupled_stiffness(
            world, Hidden("cross_coupled_stiffness", plane, {"stiffness_n_per_m": stiffness})
        ).truth
        return any(levitation_growth(coupled, 2 * np.pi * speed) > 0 for speed in coupled.machine.speeds)

    low, high = 1e3, 1e8  # bisected on a logarithmic scale: the machine must be stable in levitation before a drop
    while high / low > 1.02:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return (plane, {"stiffness_n_per_m": low * between(level, 0.05, 0.7)})


@effect(_draw_cross_coupling)
def cross_coupled_stiffness(world: World, h: Hidden) -> World:
    """Force across the displacement at a plane, feeding forward whirl."""
    position = next(p.position for p in world.truth.machine.planes if p.name == h.where)
    stiffness = world.truth.seal_stiffness + 1j * h.parameters["stiffness_n_per_m"]
    return replace(world, truth=replace(world.truth, seal_position=position, seal_stiffness=stiffness))


def _draw_windage(rng: Rng, world: World, level: float) -> tuple[str, Values]:
    share = between(level, 0.15, 0.95)
    speed, decay = 2 * np.pi * world.truth.machine.speeds[2], world.truth.decay_time
    quadratic, linear = share / (decay * speed), (1 - share) / decay
    at_100 = quadratic * 2 * np.pi * 100
    return "rotor", {
        "share": at_100 / (at_100 + linear),
        "reference_speed_hz": 100.0,
        "quadratic_per_rad": quadratic,
        "linear_per_s": linear,
    }


@effect(_draw_windage)
def quadratic_windage(world: World, h: Hidden) -> World:
    """Drag linear and quadratic in speed; at the third drop's nominal speed the total is unchanged."""
    decay, quadratic = 1 / h.parameters["linear_per_s"], h.parameters["quadratic_per_rad"]
    return replace(world, truth=replace(world.truth, decay_time=decay, quadratic_rate=quadratic))
