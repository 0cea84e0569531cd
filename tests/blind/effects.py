"""What can be hidden in a machine: the catalogue's effects and others that the catalogue lacks, each with its law here.

Every effect draws a place and sizes (`level` from 0, weak, to 1, strong; sizes spread over it logarithmically), and
changes the true machine or its sensors.  Lengths scale with the machine's gap, forces with its weight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.blind.sensors import Sensors
from tests.blind.truth import Truth, levitation_growth, rotor_modes

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
    """An effect at a place with its parameters, SI (the suffix says the unit)."""

    name: str
    where: str
    parameters: Values


Draw = Callable[[Rng, World, float], Hidden]
Apply = Callable[[World, Hidden], World]
_EFFECTS: dict[str, tuple[Draw, Apply]] = {}

ENDS = ("NDE", "DE")


def _effect(draw: Draw) -> Callable[[Apply], Apply]:
    def keep(apply: Apply) -> Apply:
        _EFFECTS[apply.__name__] = (draw, apply)
        return apply

    return keep


def names() -> tuple[str, ...]:
    """Names of the catalogue's effects."""
    return tuple(name for name in _EFFECTS if not name.startswith("x_"))


def outside() -> tuple[str, ...]:
    """Names of the effects that the catalogue lacks."""
    return tuple(name for name in _EFFECTS if name.startswith("x_"))


def draw(name: str, rng: Rng, world: World, level: float) -> Hidden:
    """Return place and parameters of an effect of a level between 0 (weak) and 1 (strong)."""
    return replace(_EFFECTS[name][0](rng, world, level), name=name)


def apply(world: World, hidden: Hidden) -> World:
    """Return the world with the effect in it."""
    return _EFFECTS[hidden.name][1](world, hidden)


def _between(level: float, low: float, high: float) -> float:
    return float(low * (high / low) ** level)


def _length(world: World, level: float, low: float, high: float) -> float:
    """A length, given for a gap of 250 um."""
    return _between(level, low, high) * world.truth.machine.touchdowns[0].gap.nominal / 250e-6


def _weight(world: World) -> float:
    return rotor_modes(world.truth).mass * 9.80665


def _end(rng: Rng) -> str:
    return str(rng.choice(ENDS))


def _end_or_both(rng: Rng) -> str:
    return str(rng.choice(("NDE", "DE", "both")))


def _angle(rng: Rng) -> float:
    return float(rng.uniform(-np.pi, np.pi))


def _sign(rng: Rng) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _probe(rng: Rng, world: World) -> str:
    return str(rng.choice([p.name for p in world.truth.machine.probes]))


def _plane(rng: Rng, world: World) -> str:
    return str(rng.choice([p.name for p in world.truth.machine.planes]))


def _at_bearings(world: World, where: str, **values: float) -> World:
    bearings = tuple(
        b._replace(**values) if where in (end, "both") else b for end, b in zip(ENDS, world.truth.bearings, strict=True)
    )
    return replace(world, truth=replace(world.truth, bearings=bearings))


def _at_probe(values: tuple[float, ...], world: World, where: str, value: float) -> tuple[float, ...]:
    return tuple(value if p.name == where else v for p, v in zip(world.truth.machine.probes, values, strict=True))


# ---------------------------------------------------------------------------------------------- magnetic bearings, rotor


@_effect(lambda rng, w, level: Hidden("", "rotor", {"decay_time_s": _between(level, 0.2e-3, 4e-3)}))
def residual_magnetic_force(world: World, h: Hidden) -> World:
    """The force at switch-off, as it was, decays exponentially."""
    return replace(world, truth=replace(world.truth, magnet_decay=h.parameters["decay_time_s"]))


def _draw_unbalance(rng: Rng, world: World, level: float) -> Hidden:
    plane = _plane(rng, world)
    nominal = next(p.amount.nominal for p in world.truth.machine.planes if p.name == plane)
    return Hidden("", plane, {"amount_kg_m": nominal * _between(level, 1.8, 10), "phase_rad": _angle(rng)})


@_effect(_draw_unbalance)
def unbalance(world: World, h: Hidden) -> World:
    """The plane's whole unbalance is this, in place of what the balancing sheet says."""
    whole = h.parameters["amount_kg_m"] * np.exp(1j * h.parameters["phase_rad"])
    planes = world.truth.machine.planes
    new = tuple(whole if p.name == h.where else u for p, u in zip(planes, world.truth.unbalance, strict=True))
    return replace(world, truth=replace(world.truth, unbalance=new))


@_effect(lambda rng, w, level: Hidden("", "rotor", {"bow_m": _length(w, level, 2e-6, 35e-6), "phase_rad": _angle(rng)}))
def shaft_bow(world: World, h: Hidden) -> World:
    """The unstressed shaft is a parabola, `bow` midway between the touchdown bearings and none at them."""
    return replace(
        world, truth=replace(world.truth, bow=h.parameters["bow_m"] * np.exp(1j * h.parameters["phase_rad"]))
    )


def _draw_cross_coupling(rng: Rng, world: World, level: float) -> Hidden:
    plane = _plane(rng, world)

    def unstable(stiffness: float) -> bool:
        coupled = cross_coupled_stiffness(world, Hidden("", plane, {"stiffness_n_per_m": stiffness})).truth
        return any(levitation_growth(coupled, 2 * np.pi * speed) > 0 for speed in coupled.machine.speeds)

    low, high = 1e3, 1e8  # halved on a logarithmic scale: a machine that is dropped has levitated before
    while high / low > 1.02:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return Hidden("", plane, {"stiffness_n_per_m": low * _between(level, 0.05, 0.7)})


@_effect(_draw_cross_coupling)
def cross_coupled_stiffness(world: World, h: Hidden) -> World:
    """Force across the displacement at a plane, feeding forward whirl."""
    position = next(p.position for p in world.truth.machine.planes if p.name == h.where)
    stiffness = world.truth.seal_stiffness + 1j * h.parameters["stiffness_n_per_m"]
    return replace(world, truth=replace(world.truth, seal_position=position, seal_stiffness=stiffness))


def _draw_windage(rng: Rng, world: World, level: float) -> Hidden:
    share = _between(level, 0.15, 1.0)
    speed = 2 * np.pi * world.truth.machine.speeds[2]
    linear = (1 - share) / world.truth.decay_time
    return Hidden(
        "",
        "rotor",
        {"share": share, "quadratic_per_rad": share / (world.truth.decay_time * speed), "linear_per_s": linear},
    )


@_effect(_draw_windage)
def quadratic_windage(world: World, h: Hidden) -> World:
    """Drag linear and quadratic in speed; `share` of it is quadratic at the third drop's nominal speed."""
    decay = 1 / max(h.parameters["linear_per_s"], 1e-9)
    return replace(
        world, truth=replace(world.truth, decay_time=decay, quadratic_rate=h.parameters["quadratic_per_rad"])
    )


# ----------------------------------------------------------------------------------------------------------- bearings


def _draw_stribeck(rng: Rng, world: World, level: float) -> Hidden:
    rise = _between(level, 0.04, 0.35)
    sliding = world.truth.bearings[0].friction
    return Hidden(
        "",
        _end_or_both(rng),
        {
            "static": sliding + rise,
            "sliding": sliding,
            "stribeck_speed_m_per_s": float(np.exp(rng.uniform(*np.log([0.5, 5.0])))),
        },
    )


@_effect(_draw_stribeck)
def stribeck_friction(world: World, h: Hidden) -> World:
    """The coefficient falls from static to sliding with slip speed, exponentially unless the laws are strange."""
    rise = h.parameters["static"] - h.parameters["sliding"]
    return _at_bearings(world, h.where, friction_excess=rise, stribeck_speed=h.parameters["stribeck_speed_m_per_s"])


@_effect(
    lambda rng, w, level: Hidden(
        "", _end(rng), {"amplitude_m": _length(w, level, 2e-6, 40e-6), "angle_rad": float(rng.uniform(0, np.pi))}
    )
)
def oval_clearance(world: World, h: Hidden) -> World:
    """The gap is wider by the amplitude along the angle and narrower across it."""
    return _at_bearings(world, h.where, oval=h.parameters["amplitude_m"], oval_angle=h.parameters["angle_rad"])


@_effect(
    lambda rng, w, level: Hidden(
        "", _end(rng), {"amplitude_m": _length(w, level, 1e-6, 25e-6), "order": float(rng.integers(2, 5))}
    )
)
def ring_out_of_round(world: World, h: Hidden) -> World:
    """Lobes of the bore turn with the ring."""
    return _at_bearings(world, h.where, lobe=h.parameters["amplitude_m"], lobe_order=h.parameters["order"])


def _draw_waviness(rng: Rng, world: World, level: float) -> Hidden:
    outer = float(rng.integers(0, 2))
    return Hidden(
        "",
        _end(rng),
        {"amplitude_m": _length(world, level, 0.5e-6, 12e-6), "order": float(rng.integers(2, 7)), "outer_race": outer},
    )


@_effect(_draw_waviness)
def race_waviness(world: World, h: Hidden) -> World:
    """A race bulges inwards by a cosine of the azimuth; the inner one turns with the ring."""
    size, outer = h.parameters["amplitude_m"], bool(h.parameters["outer_race"])
    return _at_bearings(
        world,
        h.where,
        inner_wave=0.0 if outer else size,
        outer_wave=size if outer else 0.0,
        wave_order=h.parameters["order"],
    )


def _draw_ball(rng: Rng, world: World, level: float) -> Hidden:
    ball = int(rng.integers(0, world.truth.bearings[0].balls))
    return Hidden("", _end(rng), {"ball": float(ball), "excess_m": _length(world, level, 3e-6, 40e-6)})


@_effect(_draw_ball)
def off_sized_ball(world: World, h: Hidden) -> World:
    """One ball is larger in diameter."""
    return _at_bearings(world, h.where, odd_ball=int(h.parameters["ball"]), odd_excess=h.parameters["excess_m"])


@_effect(
    lambda rng, w, level: Hidden(
        "",
        _end_or_both(rng),
        {
            "soft_over_stiff": 1 / _between(level, 1.15, 5.0),
            "soft_angle_rad": float(rng.choice([0.0, np.pi / 2, rng.uniform(0, np.pi)])),
        },
    )
)
def support_anisotropy(world: World, h: Hidden) -> World:
    """The support is softer along an angle, as stiff as ever across it."""
    return _at_bearings(
        world, h.where, soft_ratio=h.parameters["soft_over_stiff"], soft_angle=h.parameters["soft_angle_rad"]
    )


@_effect(
    lambda rng, w, level: Hidden(
        "", _end(rng), {"play_m": _length(w, level, 2e-6, 40e-6), "ratio": float(rng.uniform(0.02, 0.15))}
    )
)
def loose_support(world: World, h: Hidden) -> World:
    """Within a radial play about its place of rest the support has `ratio` of its stiffness."""
    return _at_bearings(world, h.where, play=h.parameters["play_m"], play_ratio=h.parameters["ratio"])


def _draw_hardening(rng: Rng, world: World, level: float) -> Hidden:
    where = _end_or_both(rng)
    stiffness = max(
        b.support_stiffness for e, b in zip(ENDS, world.truth.bearings, strict=True) if where in (e, "both")
    )
    # stiffness grows by this factor at the deflection of four weights
    deflection = 4 * _weight(world) / stiffness
    return Hidden("", where, {"cubic_n_per_m3": _between(level, 0.1, 5) * stiffness / deflection**2})


@_effect(_draw_hardening)
def hardening_support(world: World, h: Hidden) -> World:
    """Force k u + c u^3, radial."""
    return _at_bearings(world, h.where, cubic=h.parameters["cubic_n_per_m3"])


def _draw_foundation(rng: Rng, world: World, level: float) -> Hidden:
    mass = world.truth.bearings[0].support_mass * float(rng.uniform(3, 12))
    # the weaker the effect, the stiffer the ground
    frequency = 2 * np.pi * _between(level, 400, 30)
    stiffness = mass * frequency**2
    damping = 2 * float(rng.uniform(0.02, 0.08)) * mass * frequency
    return Hidden(
        "",
        _end_or_both(rng),
        {"mass_kg": mass, "stiffness_n_per_m": stiffness, "damping_n_s_per_m": damping},
    )


@_effect(_draw_foundation)
def foundation_mode(world: World, h: Hidden) -> World:
    """The support stands on a mass on spring and damper, one for each end."""
    p = h.parameters
    return _at_bearings(
        world,
        h.where,
        foundation_mass=p["mass_kg"],
        foundation_stiffness=p["stiffness_n_per_m"],
        foundation_damping=p["damping_n_s_per_m"],
    )


def _draw_drag(rng: Rng, world: World, level: float) -> Hidden:
    end = _end(rng)
    nominal = world.truth.machine.touchdowns[ENDS.index(end)].ring_drag.nominal
    return Hidden("", end, {"torque_n_m": nominal * _between(level, 5, 120)})


@_effect(_draw_drag)
def ring_drag(world: World, h: Hidden) -> World:
    """The ring's whole drag torque."""
    return _at_bearings(world, h.where, ring_drag=h.parameters["torque_n_m"])


@_effect(
    lambda rng, w, level: Hidden(
        "", _end_or_both(rng), {"growth_m_per_j": _length(w, level, 5e-9, 150e-9) * 1000 / _weight(w)}
    )
)
def thermal_growth(world: World, h: Hidden) -> World:
    """The gap closes in proportion to the heat of friction so far."""
    return _at_bearings(world, h.where, growth=h.parameters["growth_m_per_j"])


# ------------------------------------------------------------------------------------------------------------ sensors


@_effect(lambda rng, w, level: Hidden("", _probe(rng, w), {"gain": 1 + _sign(rng) * _between(level, 0.01, 0.15)}))
def probe_gain(world: World, h: Hidden) -> World:
    """The channel reads `gain` times the displacement from the bearing's centre."""
    gain = _at_probe(world.sensors.gain, world, h.where, h.parameters["gain"])
    return replace(world, sensors=replace(world.sensors, gain=gain))


@_effect(
    lambda rng, w, level: Hidden(
        "", _probe(rng, w), {"angle_error_rad": _sign(rng) * np.radians(_between(level, 0.7, 15))}
    )
)
def probe_angle(world: World, h: Hidden) -> World:
    """The probe stands further towards +y by the error."""
    turned = _at_probe(world.sensors.turned, world, h.where, h.parameters["angle_error_rad"])
    return replace(world, sensors=replace(world.sensors, turned=turned))


def _draw_runout(rng: Rng, world: World, level: float) -> Hidden:
    first = _length(world, level, 1.5e-6, 25e-6)
    return Hidden(
        "",
        _end(rng),
        {
            "first_m": first,
            "first_phase_rad": _angle(rng),
            "second_m": first * float(rng.uniform(0.1, 0.8)),
            "second_phase_rad": _angle(rng),
        },
    )


@_effect(_draw_runout)
def probe_runout(world: World, h: Hidden) -> World:
    """Runout of the surface under an end's probes, on top of the usual: a_k cos(k (facing) + phase_k)."""
    p, end = h.parameters, ENDS.index(h.where)
    runout = list(world.sensors.runout)
    first, second, third = runout[end]
    first += p["first_m"] * np.exp(1j * p["first_phase_rad"])
    second += p["second_m"] * np.exp(1j * p["second_phase_rad"])
    runout[end] = (first, second, third)
    return replace(world, sensors=replace(world.sensors, runout=tuple(runout)))


@_effect(
    lambda rng, w, level: Hidden(
        "", _end(rng), {"factor": _sign(rng) * _between(level, 0.01, 0.2), "into": float(rng.integers(0, 2))}
    )
)
def probe_crosstalk(world: World, h: Hidden) -> World:
    """A factor of the end's other channel is in its channel A (`into` 0) or B (1)."""
    leak = list(world.sensors.leak)
    leak[2 * ENDS.index(h.where) + int(h.parameters["into"])] = h.parameters["factor"]
    return replace(world, sensors=replace(world.sensors, leak=tuple(leak)))


@_effect(lambda rng, w, level: Hidden("", _probe(rng, w), {"delay_s": round(_between(level, 1, 50)) / 20e3}))
def channel_lag(world: World, h: Hidden) -> World:
    """The channel shows what was, by a whole number of samples."""
    late = _at_probe(world.sensors.late, world, h.where, h.parameters["delay_s"])
    return replace(world, sensors=replace(world.sensors, late=late))


# ------------------------------------------------------------------------------------------------ outside the catalogue


@_effect(
    lambda rng, w, level: Hidden(
        "",
        "rotor",
        {
            "amplitude_m": _length(w, level, 3e-6, 25e-6),
            "frequency_hz": float(rng.uniform(25, 160)),
            "direction_rad": _angle(rng),
            "phase_rad": _angle(rng),
        },
    )
)
def x_floor_vibration(world: World, h: Hidden) -> World:
    """The ground under both supports shakes."""
    p = h.parameters
    return _at_bearings(
        world,
        "both",
        floor_x=p["amplitude_m"] * np.cos(p["direction_rad"]),
        floor_y=p["amplitude_m"] * np.sin(p["direction_rad"]),
        floor_frequency=2 * np.pi * p["frequency_hz"],
        floor_phase=p["phase_rad"],
    )


def _draw_lost_part(rng: Rng, world: World, level: float) -> Hidden:
    plane = _plane(rng, world)
    nominal = next(p.amount.nominal for p in world.truth.machine.planes if p.name == plane)
    return Hidden(
        "",
        plane,
        {
            "amount_kg_m": nominal * _between(level, 4, 15),
            "phase_rad": _angle(rng),
            "time_s": float(rng.uniform(0.115, 0.2)),
        },
    )


@_effect(_draw_lost_part)
def x_sudden_unbalance(world: World, h: Hidden) -> World:
    """A part flies off during every drop."""
    p = h.parameters
    index = [plane.name for plane in world.truth.machine.planes].index(h.where)
    part = p["amount_kg_m"] * np.exp(1j * p["phase_rad"])
    return replace(world, truth=replace(world.truth, late_plane=index, late_unbalance=part, late_time=p["time_s"]))


@_effect(
    lambda rng, w, level: Hidden(
        "",
        _probe(rng, w),
        {"drift_m": _sign(rng) * _length(w, level, 5e-6, 60e-6), "time_s": float(rng.uniform(0.03, 0.2))},
    )
)
def x_probe_drift(world: World, h: Hidden) -> World:
    """A probe warms up and its zero drifts from the release on."""
    drift = _at_probe(world.sensors.drift, world, h.where, h.parameters["drift_m"])
    return replace(world, sensors=replace(world.sensors, drift=drift, drift_time=h.parameters["time_s"]))


@_effect(
    lambda rng, w, level: Hidden(
        "",
        _end(rng),
        {
            "amplitude_m": _length(w, level, 4e-6, 50e-6),
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


@_effect(lambda rng, w, level: Hidden("", _end(rng), {"force_n": _between(level, 0.5, 6) * _weight(w)}))
def x_cage_fracture(world: World, h: Hidden) -> World:
    """A broken cage knocks the ring outwards once a turn of the cage."""
    return _at_bearings(world, h.where, cage_knock=h.parameters["force_n"])


@_effect(lambda rng, w, level: Hidden("", _end(rng), {"damping_n_s_per_m": _between(level, 0.1, 3) * _weight(w)}))
def x_fluid_film(world: World, h: Hidden) -> World:
    """Oil in the gap damps the journal against the ring, from the release on."""
    return _at_bearings(world, h.where, film=h.parameters["damping_n_s_per_m"])


@_effect(
    lambda rng, w, level: Hidden(
        "",
        _end(rng),
        {
            "force_n": _between(level, 0.15, 1.5) * _weight(w),
            "direction_rad": _angle(rng),
            "time_s": float(rng.uniform(0.105, 0.16)),
            "length_s": float(rng.uniform(0.002, 0.008)),
        },
    )
)
def x_magnet_kick(world: World, h: Hidden) -> World:
    """A magnetic bearing comes back for a moment, some time into every drop."""
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


@_effect(lambda rng, w, level: Hidden("", _end_or_both(rng), {"force_n": _between(level, 0.1, 1.5) * _weight(w)}))
def x_support_friction(world: World, h: Hidden) -> World:
    """Dry friction between bearing and housing."""
    return _at_bearings(world, h.where, support_friction=h.parameters["force_n"])


@_effect(lambda rng, w, level: Hidden("", "rotor", {"stiffness_n_per_m": _between(level, 60, 1000) * _weight(w)}))
def x_magnetic_pull(world: World, h: Hidden) -> World:
    """Magnetised iron at the first unbalance plane pulls the rotor along its displacement."""
    position = world.truth.machine.planes[0].position
    stiffness = world.truth.seal_stiffness + h.parameters["stiffness_n_per_m"]
    return replace(world, truth=replace(world.truth, seal_position=position, seal_stiffness=stiffness))


@_effect(lambda rng, w, level: Hidden("", "rotor", {"step_rad": _sign(rng) * np.radians(_between(level, 15, 120))}))
def x_moved_mark(world: World, h: Hidden) -> World:
    """The keyphasor's mark slips on the shaft by a step between drops."""
    return replace(world, marks=tuple(k * h.parameters["step_rad"] for k in range(4)))
