"""The blind generator by itself: closed forms, conservation, convergence, and that it shares no code."""

from __future__ import annotations

import ast
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tests.blind
from tests.blind.case import STRONG, Case, draw_case, write
from tests.blind.drop import GRAVITY, PER_END, Bearing
from tests.blind.effects import apply, draw, names, outside
from tests.blind.hidden import World
from tests.blind.machine import Machine, Magnet, generator
from tests.blind.rotor import Disk, modes
from tests.blind.sensors import Channels, read
from tests.blind.truth import RATE, Start, Truth, rotor_modes, run

STILL = Start(1e-6, 0.0, (0j, 0j), (0.0, 0.0), (0.0, 0.0))


@pytest.fixture(scope="module")
def truth() -> Truth:
    """The generator rotor with plain laws, balanced."""
    plain = draw_case(1, kind="none", strangeness=0.0).plain.truth
    return replace(plain, unbalance=(0j, 0j))


def at_bearings(truth: Truth, **values: Any) -> Truth:
    nde, de = (b._replace(**values) for b in truth.bearings)
    return replace(truth, bearings=(nde, de))


def test_no_code_is_shared() -> None:
    folder = Path(tests.blind.__file__).parent
    files = [file for file in folder.glob("*.py") if not file.name.startswith("test_")]
    assert len(files) > 10
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            imported = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                imported = [node.module or ""]
            assert not {name.split(".")[0] for name in imported} & {"tdbsim", "tdbmon"}, file


def test_free_beam_has_eulers_frequencies() -> None:
    length, diameter = 2.0, 0.02
    found = modes(
        [(length, diameter)], [], elastic_modulus=2e11, density=7800.0, poisson_ratio=0.3, count=5, element=0.05
    )
    wave = np.array([4.730041, 7.853205, 10.995608]) / length
    slender = wave**2 * np.sqrt(2e11 * np.pi * diameter**4 / 64 / (7800 * np.pi * diameter**2 / 4))
    # shear and rotary inertia lower them by about (k d)^2 (1/32 + ...), here 3e-4 to 2e-3
    np.testing.assert_allclose(found.frequency[2:], slender, rtol=2.5e-3)
    assert np.all(found.frequency[2:] < slender)
    assert found.mass == pytest.approx(7800 * np.pi * diameter**2 / 4 * length)


def test_wheel_and_gyroscopics_of_the_rigid_modes() -> None:
    disk = Disk("wheel", 0.5, 20.0, 0.4, 0.2)
    found = modes([(1.0, 0.05)], [disk], elastic_modulus=2e11, density=7800.0, poisson_ratio=0.3, count=2)
    shaft = 7800 * np.pi * 0.05**2 / 4
    polar, diametral = 0.4 + shaft * 0.05**2 / 8, 0.2 + shaft * (1 / 12 + 0.05**2 / 16)
    assert found.mass == pytest.approx(20 + shaft)
    assert found.polar_inertia == pytest.approx(polar)
    # of two rigid modes, tilting alone has gyroscopics: polar over diametral inertia
    assert np.trace(found.gyroscopic) == pytest.approx(polar / diametral, rel=1e-6)


def test_falls_freely_until_it_touches(truth: Truth) -> None:
    """The centre of mass does; the shaft also springs back from its sag.  Windage leaves it 20 nm/s at the release."""
    shaft = rotor_modes(truth)
    start = replace(STILL, speed=2 * np.pi * 100, set_point=(2e-5 + 1e-5j, -1e-5 + 3e-5j))
    held, drop = (run(truth, start, samples=samples, levitated=100) for samples in (100, 240))
    n = len(shaft.frequency)
    for first, expected in ((0, 0.0), (n, -GRAVITY * (140 / RATE) ** 2 / 2)):
        centre = [shaft.weight @ d.last[first : first + n] / shaft.mass for d in (held, drop)]
        assert centre[1] - centre[0] == pytest.approx(expected, abs=1e-9)
    assert drop.force.max() == 0.0


def test_rests_where_springs_balance_the_weight(truth: Truth) -> None:
    quiet = at_bearings(truth, contact_damping=30.0, support_damping=2e5, ball_damping=4000.0)
    drop = run(replace(quiet, modal_damping=0.05), STILL, samples=20_000, levitated=10)
    shaft = rotor_modes(truth)
    a, b = (t.position for t in truth.machine.touchdowns)
    moment = float(
        np.sum([d.mass * d.position for d in truth.machine.disks])
        + sum(
            7850 * np.pi * diameter**2 / 4 * length * middle
            for (length, diameter), middle in zip(truth.machine.sections, _middles(truth.machine.sections), strict=True)
        )
    )
    loads = np.array([b - moment / shaft.mass, moment / shaft.mass - a]) / (b - a) * shaft.mass * GRAVITY
    n = len(shaft.frequency)
    for e, bearing in enumerate(truth.bearings):
        ring = drop.last[4 * n + 2 + e * PER_END :]
        at = shaft.at(truth.machine.touchdowns[e].position)
        x, y = at @ drop.last[:n], at @ drop.last[n : 2 * n]
        depth = np.hypot(x - ring[0], y - ring[1]) - bearing.gap
        assert depth == pytest.approx((loads[e] / bearing.contact_stiffness) ** 0.9, rel=2e-3)
        carried = loads[e] + bearing.ring_mass * GRAVITY
        assert -ring[8] == pytest.approx(carried / bearing.support_stiffness, rel=2e-3)
        # the cage stands with ball 1 at +x: the vertical is between balls or on one, the sum says which
        azimuth = 2 * np.pi * np.arange(bearing.balls) / bearing.balls
        press = np.maximum(
            (ring[0] - ring[7]) * np.cos(azimuth) + (ring[1] - ring[8]) * np.sin(azimuth) - bearing.ball_clearance / 2,
            0,
        )
        pushed = bearing.ball_stiffness * press**1.5
        assert pushed @ np.sin(azimuth) == pytest.approx(-carried, rel=2e-3)


def _middles(sections: list[tuple[float, float]]) -> np.ndarray:
    lengths = np.array([length for length, _ in sections])
    return np.asarray(np.cumsum(lengths) - lengths / 2)


def test_rigid_rotor_whirls_as_the_closed_form_says() -> None:
    """A stiff shaft on two equal bearings about its middle, unbalanced there: a mass on a spring and damper."""
    m = generator(lambda low, high: 1.0)
    stiff: Machine = replace(
        m,
        sections=[(1.24, 0.1)],
        disks=[],
        planes=[replace(m.planes[0], position=0.62)],
        magnets=tuple(Magnet(g.name, z, g.stiffness, g.damping) for g, z in zip(m.magnets, (0.3, 0.94), strict=True)),  # type: ignore[arg-type]
        elastic_modulus=2e15,
    )
    plain = draw_case(1, kind="none", strangeness=0.0).plain.truth
    amount, k, c, w = 1e-4, 4e6, 4e3, 2 * np.pi * 60
    truth = replace(
        plain, machine=stiff, unbalance=(amount + 0j,), elastic_modulus=2e15, decay_time=1e9,
        magnet_stiffness=(k, k), magnet_damping=(c, c),
    )  # fmt: skip
    drop = run(truth, replace(STILL, speed=w, shaft_angle=0.4), samples=2000, levitated=5000, steps=48)
    mass = rotor_modes(truth).mass
    expected = amount * w**2 / (2 * k - mass * w**2 + 2j * w * c) * np.exp(1j * drop.angle[-1])
    np.testing.assert_allclose(drop.places[-1, :, 0] + 1j * drop.places[-1, :, 1], expected, rtol=1e-3)


def test_energy_is_kept_through_contact(truth: Truth) -> None:
    """Nothing rubs and nothing is damped: what the fall gives comes back, contact by contact."""
    ideal = at_bearings(
        truth, contact_damping=0.0, friction=0.0, ball_damping=0.0, support_damping=0.0, ring_drag=0.0
    )  # fmt: skip
    ideal = replace(ideal, modal_damping=0.0, decay_time=1e12)
    start = replace(STILL, speed=2 * np.pi * 100)
    before = run(ideal, start, samples=1, levitated=0, steps=24)
    after = run(ideal, start, samples=600, levitated=0, steps=24)
    assert after.force.max(axis=0).min() > 1000.0
    fallen = _potential(ideal, after.last) - _potential(ideal, before.last)
    total = _energy(ideal, after.last) - _energy(ideal, before.last)
    assert fallen < -0.05  # J
    assert abs(total) < 1e-3 * abs(fallen)


def _potential(truth: Truth, state: np.ndarray) -> float:
    shaft = rotor_modes(truth)
    n = len(shaft.frequency)
    return GRAVITY * float(shaft.weight @ state[n : 2 * n])


def _energy(truth: Truth, state: np.ndarray) -> float:
    shaft = rotor_modes(truth)
    n = len(shaft.frequency)
    qx, qy, vx, vy = (state[k * n : (k + 1) * n] for k in range(4))
    total = _potential(truth, state) + 0.5 * float(vx @ vx + vy @ vy)
    total += 0.5 * float(shaft.frequency**2 @ (qx**2 + qy**2))
    for e, b in enumerate(truth.bearings):
        z = state[4 * n + 2 + e * PER_END : 4 * n + 2 + (e + 1) * PER_END]
        at = shaft.at(truth.machine.touchdowns[e].position)
        depth = max(float(np.hypot(at @ qx - z[0], at @ qy - z[1])) - b.gap, 0.0)
        total += b.contact_stiffness * depth ** (b.contact_exponent + 1) / (b.contact_exponent + 1)
        azimuth = z[6] + 2 * np.pi * np.arange(b.balls) / b.balls
        press = (z[0] - z[7]) * np.cos(azimuth) + (z[1] - z[8]) * np.sin(azimuth) - b.ball_clearance / 2
        total += float(np.sum(0.4 * b.ball_stiffness * np.maximum(press, 0) ** 2.5))
        total += 0.5 * b.ring_mass * (z[2] ** 2 + z[3] ** 2) + b.ring_mass * GRAVITY * z[1]
        total += 0.5 * b.support_mass * (z[9] ** 2 + z[10] ** 2) + 0.5 * b.support_stiffness * (z[7] ** 2 + z[8] ** 2)
    return total


@pytest.mark.parametrize("strangeness", [0.0, 1.0])
def test_steps_are_short_enough_through_contact(strangeness: float) -> None:
    case = draw_case(2, kind="none", strangeness=strangeness)
    coarse, fine, finest = (
        run(case.world.truth, case.starts[1], samples=1000, levitated=200, steps=steps).places for steps in (12, 24, 96)
    )
    # 40 ms after the release, several contacts on
    assert np.abs(coarse - finest).max() < 50e-9
    assert np.abs(fine - finest).max() < 0.5 * np.abs(coarse - finest).max()


def test_contact_laws_agree_at_the_working_load() -> None:
    """Strange contacts keep the stiffness at twice the rotor's weight, but for 5 %."""
    for seed in range(5):
        case = draw_case(seed, kind="none", strangeness=1.0)
        load = 2 * rotor_modes(case.world.truth).mass * GRAVITY

        def slope(b: Bearing, load: float = load) -> float:
            depth = (load / b.contact_stiffness) ** (1 / b.contact_exponent)
            return b.contact_exponent * load / depth

        for b, t in zip(case.world.truth.bearings, case.machine.touchdowns, strict=True):
            usual = b._replace(contact_stiffness=t.contact_stiffness, contact_exponent=10 / 9)
            assert slope(b) == pytest.approx(slope(usual), rel=0.06)


@pytest.mark.parametrize("seed", range(1, 9))
def test_true_values_lie_within_the_machine_file(seed: int) -> None:
    case = draw_case(seed)
    truth = case.plain.truth
    for b, t in zip(truth.bearings, case.machine.touchdowns, strict=True):
        for true, known in (
            (b.gap, t.gap), (b.friction, t.friction), (b.contact_damping, t.contact_damping),
            (b.ring_drag, t.ring_drag), (b.ball_clearance, t.ball_clearance),
            (b.support_stiffness, t.support_stiffness), (b.support_damping, t.support_damping),
        ):  # fmt: skip
            assert abs(true / known.nominal - 1) < known.percent / 100


def test_strong_cases_hide_what_shows_in_one_machine() -> None:
    cases = [draw_case(seed, strong=True) for seed in range(1, 9)]
    assert {case.machine.name for case in cases} == {cases[0].machine.name}
    assert all(case.machine == cases[0].machine and case.strangeness == 0 for case in cases)
    assert {case.kind for case in cases} > {"effect", "none"}
    assert all(level >= STRONG for case in cases if case.kind == "effect" for level in case.levels)


@pytest.fixture(scope="module")
def usual() -> tuple[Case, Channels]:
    """A case with nothing hidden, and what its slowest drop shows."""
    case = draw_case(1, kind="none", strangeness=0.0)
    return case, _shown(case, case.plain)


def _shown(case: Case, world: World) -> Channels:
    # a quarter of a second: a ring comes to shaft speed, and what rubs gets hot
    drop = run(world.truth, case.starts[0], samples=6000, levitated=500)
    return read(drop, case.machine, world.sensors, world.marks[1], np.random.default_rng(0), levitated=500)


@pytest.mark.parametrize("name", [*names(), *outside()])
def test_an_effect_shows(name: str, usual: tuple[Case, Channels]) -> None:
    case, without = usual
    hidden = draw(name, np.random.default_rng(0), case.plain, 1.0)
    shown = _shown(case, apply(case.plain, hidden))
    assert np.isfinite(shown.probes).all()
    assert np.abs(shown.probes).max() < 900e-6
    moved = np.abs(shown.probes - without.probes).max()
    slower = np.abs(shown.speed - without.speed).max()
    assert moved > 10 * case.plain.sensors.noise or slower > 0.1 or np.any(shown.keyphasor != without.keyphasor)


def test_same_seed_same_bytes(tmp_path: Path) -> None:
    case = draw_case(3, kind="pair")
    for folder in ("a", "b"):
        write(draw_case(3, kind="pair"), tmp_path / folder)
    for file in sorted((tmp_path / "a").iterdir()):
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes(), file.name
    answer = json.loads((tmp_path / "a" / "answer.json").read_text())
    assert set(answer["hidden"]) == {h.name for h in case.hidden}
    other = draw_case(4, kind="pair")
    assert other.hidden != case.hidden
