"""Drops of the blind generator with plain laws against those of the simulator at the same true values."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tdbsim.effect import catalogue
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, simulate
from tdbsim.stated_effects import parse

from tests.blind.case import draw_case
from tests.blind.effects import apply
from tests.blind.hidden import Hidden, World
from tests.blind.machine import Known, Machine, toml
from tests.blind.sensors import read
from tests.blind.truth import LEAD, RATE, Array, Drop, Start, Truth, levitation, rotor_modes, run

RELEASE = 400  # samples levitated
LENGTH = 600  # samples after the release: 30 ms


def as_true(truth: Truth) -> Machine:
    """The machine file with all values true and exact."""
    m = truth.machine
    nde, de = (
        replace(
            t,
            gap=Known(b.gap),
            contact_damping=Known(b.contact_damping),
            friction=Known(b.friction),
            ring_drag=Known(b.ring_drag),
            ball_clearance=Known(b.ball_clearance),
            support_stiffness=Known(b.support_stiffness),
            support_damping=Known(b.support_damping),
        )
        for t, b in zip(m.touchdowns, truth.bearings, strict=True)
    )
    one, two = (
        replace(g, stiffness=Known(k), damping=Known(c))
        for g, k, c in zip(m.magnets, truth.magnet_stiffness, truth.magnet_damping, strict=True)
    )
    planes = [
        replace(p, amount=Known(abs(u)), phase=Known(float(np.angle(u))))
        for p, u in zip(m.planes, truth.unbalance, strict=True)
    ]
    return replace(m, touchdowns=(nde, de), magnets=(one, two), planes=planes, decay_time=Known(truth.decay_time))


def both_drops(world: World, plain: World, start: Start, effects: list[str], folder: Path) -> tuple[Drop, xr.Dataset]:
    """A drop of this generator, and the simulator's from the release on."""
    drop = run(world.truth, start, samples=RELEASE + LENGTH, levitated=RELEASE)
    path = folder / "machine.toml"
    path.write_text(toml(as_true(plain.truth)))
    shaft, k = rotor_modes(world.truth), RELEASE + LEAD
    mean = levitation(world.truth, start).place
    ends = [complex(shaft.at(t.position) @ mean) for t in world.truth.machine.touchdowns]
    plan = DropPlan(
        speed=float(drop.speed[k]) / (2 * np.pi),
        seconds=LENGTH / RATE,
        sampling=RATE,
        set_point=((ends[0].real, ends[0].imag), (ends[1].real, ends[1].imag)),
        shaft_angle=float(drop.angle[k]),
        ring_angle=start.ring_angle,
        cage_angle=start.cage_angle,
    )
    return drop, simulate(load_machine(path), plan, [parse(text) for text in effects], bending=24)


def both(world: World, plain: World, start: Start, effects: list[str], folder: Path) -> tuple[Array, Array]:
    """The probes' readings after the release, from both programs (samples, 4), m."""
    drop, rows = both_drops(world, plain, start, effects, folder)
    # the simulator's ideal sensors: no noise, and no runout but what an effect brings
    runout = tuple(
        (with_it[0] - usual[0], with_it[1] - usual[1], 0j)
        for with_it, usual in zip(world.sensors.runout, plain.sensors.runout, strict=True)
    )
    silent = replace(world.sensors, noise=0.0, hum=0.0, speed_noise=0.0, runout=runout)
    ours = read(drop, world.truth.machine, silent, 0.0, np.random.default_rng(0)).probes[RELEASE:]
    theirs = np.column_stack([rows[p.name].values for p in world.truth.machine.probes])
    return ours, theirs[: len(ours)]


@pytest.mark.parametrize("seed", [1, 4, 5], ids=["generator", "spindle", "compressor"])
def test_a_plain_drop_is_the_simulators(seed: int, tmp_path: Path) -> None:
    case = draw_case(seed, kind="none", strangeness=0.0)
    ours, theirs = both(case.world, case.plain, case.starts[1], [], tmp_path)
    error = np.abs(ours - theirs).max(axis=1)
    assert np.ptp(ours[:, :2]) > 200e-6  # fallen, and thrown back
    # before contact: levitation, rotor and release; after it, bounces amplify differences
    assert error[:80].max() < 0.05e-6
    assert error[:300].max() < 0.5e-6  # the two friction laws rise within 0.01 and 0.05 m/s of slip
    assert error.max() < 10e-6


# place and parameters here, and what the simulator's command line says for the same
SAME = {
    "residual_magnetic_force": ("rotor", {"decay_time_s": 2e-3}, "decay_time=2 ms"),
    "unbalance": ("impeller", {"amount_kg_m": 1.5e-4, "phase_rad": 1.0}, "plane=impeller,amount=150 g mm,phase=1 rad"),
    "shaft_bow": ("rotor", {"bow_m": 2e-5, "phase_rad": 1.0}, "bow=20 um,phase=1 rad"),
    "cross_coupled_stiffness": ("generator", {"stiffness_n_per_m": 5e5}, "plane=generator,stiffness=5e5 N/m"),
    "stribeck_friction": (
        "both",
        {"static_excess": 0.2, "stribeck_speed_m_per_s": 15.0},
        "where=both,static_excess=0.2,stribeck_speed=15 m/s,law=gaussian",
    ),
    "oval_clearance": ("DE", {"amplitude_m": 2e-5, "angle_rad": 0.5}, "end=DE,amplitude=20 um,angle=0.5 rad"),
    "ring_out_of_round": ("DE", {"amplitude_m": 1e-5, "order": 3.0}, "end=DE,amplitude=10 um,order=3"),
    "race_waviness": (
        "NDE",
        {"amplitude_m": 8e-6, "order": 2.0, "outer_race": 0.0},
        "end=NDE,amplitude=8 um,order=2,race=inner",
    ),
    "off_sized_ball": ("NDE", {"ball": 7.0, "deviation_m": 4e-5}, "end=NDE,ball=8,deviation=40 um"),
    "support_anisotropy": ("both", {"ratio": 0.4, "direction_rad": 0.7}, "where=both,ratio=0.4,direction=0.7 rad"),
    "loose_support": ("NDE", {"play_m": 1.5e-5, "stiffness_ratio": 0.1}, "end=NDE,play=15 um,stiffness_ratio=0.1"),
    "hardening_support": ("NDE", {"cubic_n_per_m3": 3e17}, "where=NDE,cubic=3e17 N/m^3"),
    "foundation_mode": (
        "DE",
        {"mass_kg": 200.0, "stiffness_n_per_m": 5e7, "damping_n_s_per_m": 5e3},
        "where=DE,mass=200 kg,stiffness=5e7 N/m,damping=5e3 N s/m",
    ),
    # strong growth, so that cooling shows in 30 ms
    "thermal_growth": (
        "both",
        {"growth_m_per_j": 1.9e-6, "cooling_time_s": 0.1},
        "where=both,growth=1900 nm/J,cooling_time=100 ms",
    ),
    "probe_gain": ("DE_A", {"gain": 1.1}, "probe=DE_A,gain=1.1"),
    "probe_angle": ("DE_A", {"error_rad": 0.1}, "probe=DE_A,error=0.1 rad"),
    "probe_runout": (
        "NDE",
        {"first_m": 1e-5, "first_phase_rad": 0.4, "second_m": 5e-6, "second_phase_rad": 0.6},
        "where=NDE,first=10 um,first_phase=0.4 rad,second=5 um,second_phase=0.6 rad",
    ),
    "probe_crosstalk": ("DE", {"factor": 0.1, "into": 1.0}, "where=DE,factor=0.1"),
    "channel_lag": ("DE_B", {"delay_s": 5e-4}, "probe=DE_B,delay=500 us"),
}


# effects on the turning of rotor and rings, which have tests of their own below
TURNING = ("ring_drag", "quadratic_windage")


def test_every_effect_of_the_catalogue_is_here() -> None:
    assert {*SAME, *TURNING} == {each.identifier for each in catalogue()}


@pytest.mark.parametrize("name", SAME)
def test_an_effect_is_the_simulators(name: str, tmp_path: Path) -> None:
    _assert_the_simulators([name], tmp_path)


def test_play_in_an_uneven_support_is_the_simulators(tmp_path: Path) -> None:
    _assert_the_simulators(["support_anisotropy", "loose_support"], tmp_path)


def _assert_the_simulators(names: list[str], tmp_path: Path) -> None:
    case = draw_case(1, kind="none", strangeness=0.0)
    start, world = replace(case.starts[1], ring_angle=(0.0, 0.0)), case.plain
    for name in names:
        where, parameters, _ = SAME[name]
        world = apply(world, Hidden(name, where, parameters))
    ours, theirs = both(world, case.plain, start, [f"{name}:{SAME[name][2]}" for name in names], tmp_path)
    without, _ = both(case.plain, case.plain, start, [], tmp_path)
    error = np.abs(ours - theirs).max(axis=1)
    effect = np.abs(ours - without).max(axis=1)
    assert error[:300].max() < 1e-6
    assert effect.max() > 10 * error.max()


def test_ring_drag_is_the_simulators(tmp_path: Path) -> None:
    case = draw_case(1, kind="none", strangeness=0.0)
    world = apply(case.plain, Hidden("ring_drag", "DE", {"torque_n_m": 0.3}))
    drop, rows = both_drops(world, case.plain, case.starts[1], ["ring_drag:end=DE,torque=0.3 N m"], tmp_path)
    ours, theirs = drop.ring_speed[RELEASE + LEAD :, 1], 2 * np.pi * rows["ring_speed"].sel(end="DE").values[:LENGTH]
    without = run(case.plain.truth, case.starts[1], samples=RELEASE + LENGTH, levitated=RELEASE)
    lost = without.ring_speed[-1, 1] - drop.ring_speed[-1, 1]
    assert theirs[-1] > lost > 5.0  # rad/s: rubbed up, and held back
    np.testing.assert_allclose(ours, theirs, atol=0.02 * lost)


def test_quadratic_windage_is_the_simulators(tmp_path: Path) -> None:
    case = draw_case(1, kind="none", strangeness=0.0)
    reference = 2 * np.pi * 100
    rate = 1 / case.plain.truth.decay_time
    parameters = {"linear_per_s": 0.4 * rate, "quadratic_per_rad": 0.6 * rate / reference}
    world = apply(case.plain, Hidden("quadratic_windage", "rotor", parameters))
    text = "quadratic_windage:share=0.6,reference_speed=100 Hz"
    drop, rows = both_drops(world, case.plain, case.starts[3], [text], tmp_path)
    ours, theirs = drop.speed[RELEASE + LEAD :] / (2 * np.pi), rows["speed"].values[:LENGTH]
    without = run(case.plain.truth, case.starts[3], samples=RELEASE + LENGTH, levitated=RELEASE)
    lost = (without.speed[-1] - drop.speed[-1]) / (2 * np.pi)
    assert lost > 0.1
    np.testing.assert_allclose(ours, theirs, atol=0.01 * lost)
