"""A case: one machine with or without something hidden, and four drops, drawn from a seed and written as files.

Seeds below 1,000,000 are for judging; seeds from there on are for calibrating thresholds.  `strangeness` 0 has the laws that the
machine file implies (Hunt-Crossley with 10/9, Coulomb); with 1, contact, friction, masses and noise differ as in real machines,
within limits where the verdict should still be "none".  `strong` cases have the generator without variation, plain laws, and
effects of level STRONG or more, as a rig would show them on purpose.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import netCDF4
import numpy as np

from tests.blind.drop import Bearing
from tests.blind.effects import apply, draw, names, outside
from tests.blind.hidden import ENDS, Hidden, World
from tests.blind.machine import Machine, Touchdown, draw_machine, generator, toml
from tests.blind.sensors import FULL_SCALE, Channels, Sensors, read
from tests.blind.truth import LEVITATED, RATE, Drop, Start, Truth, rotor_modes, run

KINDS = ("none", "effect", "pair", "outside")
SHARES = (0.3, 0.48, 0.1, 0.12)
FIRST_CALIBRATION_SEED = 1_000_000
STRONG = 0.4  # level from which the effect of a strong case is drawn

Rng = np.random.Generator


@dataclass(frozen=True)
class Case:
    """What is drawn before anything is simulated; `plain` is the world without the hidden effects."""

    seed: int
    kind: str
    strangeness: float
    plain: World
    world: World
    hidden: tuple[Hidden, ...]
    levels: tuple[float, ...]
    starts: tuple[Start, ...]

    @property
    def machine(self) -> Machine:
        """The machine as in its file."""
        return self.world.truth.machine


def draw_case(
    seed: int,
    *,
    kind: str | None = None,
    effect: str | None = None,
    strangeness: float | None = None,
    strong: bool = False,
) -> Case:
    """Draw a case; arguments that are not given are drawn too.  Strangeness is 0 for even seeds, 1 for odd ones, unless given."""
    streams = [np.random.default_rng([seed, k]) for k in range(5)]
    for_machine, for_truth, for_laws, for_hidden, for_starts = streams
    if strangeness is None:
        strangeness = 0.0 if strong else float(seed % 2)
    machine = generator(lambda low, high: 1.0) if strong else draw_machine(for_machine)
    plain = World(_truth(machine, for_truth), _sensors(for_truth))
    plain = _strange(plain, strangeness, for_laws)
    drawn = str(for_hidden.choice(KINDS, p=SHARES))
    if effect is not None:
        kind = "outside" if effect.startswith("x_") else "effect"
    kind = kind or drawn
    if kind == "none":
        chosen, levels = [], []
    elif kind == "pair":
        chosen = [str(name) for name in for_hidden.choice(names(), 2, replace=False)]
        levels = list(for_hidden.uniform(0.45, 1.0, 2))
    elif kind == "outside":
        chosen, levels = [str(for_hidden.choice(outside()))], [float(for_hidden.uniform(0.3, 1.0))]
    else:
        chosen, levels = [str(for_hidden.choice(names()))], [float(for_hidden.uniform(STRONG if strong else 0.0, 1.0))]
    if effect is not None:
        chosen = [effect]
    hidden = tuple(draw(name, for_hidden, plain, level) for name, level in zip(chosen, levels, strict=True))
    world = plain
    for one in hidden:
        world = apply(world, one)
    starts = tuple(_start(machine, speed, for_starts) for speed in machine.speeds)
    return Case(seed, kind, strangeness, plain, world, hidden, tuple(levels), starts)


def simulate(case: Case) -> list[tuple[Drop, Channels]]:
    """Return the four drops and the channels of their files."""
    drops = []
    for k, start in enumerate(case.starts):
        drop = run(case.world.truth, start)
        noise = np.random.default_rng([case.seed, 100 + k])
        drops.append((drop, read(drop, case.machine, case.world.sensors, case.world.marks[k], noise)))
    return drops


def write(case: Case, folder: Path) -> None:
    """Simulate a case and write its folder: machine.toml, four drops, answer.json, and drawn.json with how it was drawn."""
    drops = simulate(case)
    write_drops(case, drops, folder)
    peaks = {
        str(speed): [float(f) for f in drop.force.max(axis=0)]
        for speed, (drop, _) in zip(case.machine.speeds, drops, strict=True)
    }
    (folder / "answer.json").write_text(json.dumps(_answer(case, peaks), indent=1) + "\n", encoding="utf-8")
    drawn = {
        "seed": case.seed,
        "kind": case.kind,
        "strangeness": case.strangeness,
        "levels": {h.name: level for h, level in zip(case.hidden, case.levels, strict=True)},
        "machine": case.machine.name,
        "bearings": {end: b._asdict() for end, b in zip(ENDS, case.plain.truth.bearings, strict=True)},
        "noise_m": case.plain.sensors.noise,
    }
    (folder / "drawn.json").write_text(json.dumps(drawn, indent=1) + "\n", encoding="utf-8")


def write_drops(case: Case, drops: list[tuple[Drop, Channels]], folder: Path) -> tuple[Path, list[Path]]:
    """Write the machine file and a case's drops; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    machine_file = folder / "machine.toml"
    machine_file.write_text(toml(case.machine), encoding="utf-8")
    records = []
    for k, (speed, (_, channels)) in enumerate(zip(case.machine.speeds, drops, strict=True)):
        records.append(folder / f"drop_{speed:03d}.nc")
        _write_drop(records[-1], case.machine, speed, k + 1, channels)
    return machine_file, records


def _truth(machine: Machine, rng: Rng) -> Truth:
    # one friction and one contact damping for both ends, which have the same parts
    friction = machine.touchdowns[0].friction.drawn(rng)
    contact_damping = machine.touchdowns[0].contact_damping.drawn(rng)
    first, second = (_bearing(t, friction, contact_damping, rng) for t in machine.touchdowns)
    one, two = machine.magnets
    return Truth(
        machine=machine,
        bearings=(first, second),
        unbalance=tuple(complex(p.amount.drawn(rng) * np.exp(1j * p.phase.drawn(rng))) for p in machine.planes),
        decay_time=machine.decay_time.drawn(rng),
        magnet_stiffness=(one.stiffness.drawn(rng), two.stiffness.drawn(rng)),
        magnet_damping=(one.damping.drawn(rng), two.damping.drawn(rng)),
        elastic_modulus=machine.elastic_modulus,
        modal_damping=machine.modal_damping,
    )


def _bearing(t: Touchdown, friction: float, contact_damping: float, rng: Rng) -> Bearing:
    return Bearing(
        journal_radius=t.journal_radius,
        gap=t.gap.drawn(rng),
        contact_stiffness=t.contact_stiffness,
        contact_exponent=10 / 9,
        contact_damping=contact_damping,
        damping_form=0,
        friction=friction,
        friction_form=0,
        slip_speed=0.01,
        load_exponent=0.0,
        load_reference=1000.0,
        ring_mass=t.ring_mass,
        ring_inertia=t.ring_inertia,
        ring_drag=t.ring_drag.drawn(rng),
        balls=t.balls,
        cage_ratio=(1 - t.ball_diameter / t.pitch_diameter) / 2,
        ball_clearance=t.ball_clearance.drawn(rng),
        ball_stiffness=t.ball_stiffness,
        ball_damping=t.ball_damping,
        support_mass=t.support_mass,
        support_stiffness=t.support_stiffness.drawn(rng),
        support_damping=t.support_damping.drawn(rng),
    )


def _sensors(rng: Rng) -> Sensors:
    def runout() -> tuple[complex, complex, complex]:
        first, second, third = (
            complex(size * rng.uniform(0.5, 1.5) * np.exp(1j * rng.uniform(0, 2 * np.pi)))
            for size in (0.4e-6, 0.2e-6, 0.05e-6)
        )
        return first, second, third

    return Sensors(
        noise=float(np.exp(rng.uniform(*np.log([0.2e-6, 0.5e-6])))),
        noise_memory=0.0,
        hum=float(rng.uniform(0.05e-6, 0.3e-6)),
        runout=(runout(), runout()),
        speed_noise=0.02,
    )


def _strange(world: World, strangeness: float, rng: Rng) -> World:
    """Vary the laws; every number is drawn at any strangeness, so that seeds stay comparable."""
    s = strangeness

    def about_one(spread: float) -> float:
        return float(1 + s * spread * rng.uniform(-1, 1))

    load = 2 * rotor_modes(world.truth).mass * 9.80665
    exponent = 10 / 9 + s * (rng.uniform(1.05, 1.2) - 10 / 9)
    forms = rng.integers(0, 3, 2) if s > 0 else (rng.integers(0, 3, 2) * 0)
    slip_speed = 0.01 * 5.0 ** (s * rng.uniform(-0.4, 1.0))
    load_exponent = s * rng.uniform(-0.04, 0.04)
    stribeck_exponent = 2 - s * rng.uniform(0, 1)
    bearings = []
    for b in world.truth.bearings:
        stiffness = _same_stiffness(b.contact_stiffness, 10 / 9, exponent, load) if s > 0 else b.contact_stiffness
        bearings.append(
            b._replace(
                contact_exponent=float(exponent),
                contact_stiffness=stiffness * about_one(0.05),
                damping_form=int(forms[0]),
                friction_form=int(forms[1]),
                slip_speed=float(slip_speed),
                load_exponent=float(load_exponent),
                load_reference=load,
                stribeck_exponent=float(stribeck_exponent),
                ball_stiffness=b.ball_stiffness * about_one(0.03),
                ball_damping=b.ball_damping * about_one(0.2),
                ring_mass=b.ring_mass * about_one(0.02),
                support_mass=b.support_mass * about_one(0.02),
                cage_ratio=b.cage_ratio * about_one(0.01),
            )
        )
    truth = replace(
        world.truth,
        bearings=(bearings[0], bearings[1]),
        elastic_modulus=world.truth.elastic_modulus * about_one(0.005),
        modal_damping=world.truth.modal_damping * about_one(0.3),
    )
    sensors = replace(
        world.sensors,
        noise_memory=float(s * rng.uniform(0, 0.3)),
        zero=tuple(float(z) for z in s * rng.uniform(-3e-6, 3e-6, 4)),
    )
    return replace(world, truth=truth, sensors=sensors)


def _same_stiffness(stiffness: float, exponent: float, new: float, load: float) -> float:
    """Return K of F = K d^new whose slope at a load is that of F = K d^exponent: dF/dd = n F / d = n F (K/F)^(1/n)."""
    slope = exponent * load * (stiffness / load) ** (1 / exponent)
    return float(load * (slope / (new * load)) ** new)


def _start(machine: Machine, speed: int, rng: Rng) -> Start:
    def around() -> tuple[float, float]:
        first, second = rng.uniform(0, 2 * np.pi, 2)
        return float(first), float(second)

    reach = 0.14 * machine.touchdowns[0].gap.nominal
    one, two = (complex(*rng.uniform(-reach, reach, 2)) for _ in ENDS)
    return Start(
        speed=2 * np.pi * speed * rng.uniform(0.96, 1.0),
        shaft_angle=float(rng.uniform(0, 2 * np.pi)),
        set_point=(one, two),
        ring_angle=around(),
        cage_angle=around(),
    )


def _answer(case: Case, peaks: dict[str, list[float]]) -> dict[str, object]:
    truth = case.world.truth
    hidden = {h.name: {"where": h.where, "parameters": h.parameters} for h in case.hidden}
    ends = {}
    for end, b in zip(ENDS, truth.bearings, strict=True):
        softened = b.support_stiffness * (1 - b.soft_ratio)
        ends[end] = {
            "radial_gap_m": b.gap,
            "support_stiffness_x_n_per_m": b.support_stiffness - softened * np.cos(b.soft_angle) ** 2,
            "support_stiffness_y_n_per_m": b.support_stiffness - softened * np.sin(b.soft_angle) ** 2,
            "support_damping_n_s_per_m": b.support_damping,
            "ball_clearance_m": b.ball_clearance,
            "inner_ring_drag_n_m": b.ring_drag,
        }
    return {
        "hidden": hidden or {"none": {"where": "rotor", "parameters": {}}},
        "true": {
            "friction_sliding": truth.bearings[0].friction,
            "contact_damping_s_per_m": truth.bearings[0].contact_damping,
            "unbalance_kg_m": {
                p.name: [abs(u), float(np.angle(u))] for p, u in zip(case.machine.planes, truth.unbalance, strict=True)
            },
            "speed_decay_time_s": truth.decay_time,
            "ends": ends,
            "peak_force_n": peaks,
            "release_time_s": LEVITATED / RATE,
        },
    }


def _write_drop(path: Path, machine: Machine, speed: int, number: int, channels: Channels) -> None:
    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        count = len(channels.speed)
        file.title = f"Dropdown from {speed} Hz"
        file.machine = machine.name
        file.drop_number = np.int64(number)
        file.date = f"2026-03-{9 + number:02d}T09:00:00Z"
        file.createDimension("time", count)
        time = file.createVariable("time", "f8", ("time",), zlib=True)
        time.units = "s"
        time[:] = np.arange(count) / RATE
        for p, probe in enumerate(machine.probes):
            channel = file.createVariable(probe.name, "i2", ("time",), zlib=True, complevel=7)
            channel.units = "um"
            channel.long_name = f"shaft displacement, probe {probe.name}"
            channel.scale_factor = FULL_SCALE * 1e6 / 32768
            channel.add_offset = 0.0
            channel.set_auto_scale(False)
            channel[:] = np.round(channels.probes[:, p] / (FULL_SCALE / 32768)).astype(np.int16)
        pulse = file.createVariable("keyphasor", "i1", ("time",), zlib=True, complevel=7)
        pulse.units = "1"
        pulse.long_name = "one pulse a revolution, rising edge at the mark"
        pulse[:] = channels.keyphasor
        signal = file.createVariable("speed", "f4", ("time",), zlib=True, complevel=7, least_significant_digit=3)
        signal.units = "Hz"
        signal.long_name = "rotor speed"
        signal[:] = channels.speed
