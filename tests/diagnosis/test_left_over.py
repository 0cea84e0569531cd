"""Residuals of a model, made up to a plan (synthetic)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.sensors import ProbeChain, SensorChain, clean_readings
from tdbsim.stated_effects import parse

from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.evidence import chosen
from tdbmon.diagnosis.left_over import PHASES, LeftOver, by_direction, by_phase, left_over, seen_along, spectra, to_ends
from tdbmon.identify.crew import Crew
from tdbmon.identify.least_squares import linearised
from tests.diagnosis.plain_drop import COUNT, SPEED, bare
from tests.diagnosis.simulated import problem_of
from tests.identify import drops

SIGMA = 0.25e-6


def _readings(drop: LeftOver, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The probes' readings of a straight shaft at x + i y (k,) at the two ends."""
    a, b = (bearing.position for bearing in drops.machine().touchdown_bearings)
    share = [(probe.position - a) / (b - a) for probe in drop.probes]
    return np.array(
        [(((1 - s) * first + s * second) * np.exp(-1j * p.angle)).real for s, p in zip(share, drop.probes, strict=True)]
    )


def test_the_ends_are_where_a_straight_shaft_has_them() -> None:
    drop = bare(SIGMA)
    rng = np.random.default_rng(1)
    first, second = rng.standard_normal((2, COUNT)) + 1j * rng.standard_normal((2, COUNT))
    np.testing.assert_allclose(drop.to_ends @ _readings(drop, first, second), [first, second], rtol=1e-10)


def test_the_ends_are_where_probes_see_them_that_the_model_knows_to_be_wrong() -> None:
    """One stands 40 degrees off, one has another gain, and one leaks into another."""
    names = [probe.name for probe in drops.machine().probes]
    wrong = {names[0]: ProbeChain(angle_error=np.radians(40)), names[1]: ProbeChain(gain=1.3)}
    chain = SensorChain(probes=wrong, leaks={names[2]: (names[3], 0.2)})
    drop = bare(SIGMA, chain=chain)
    rng = np.random.default_rng(1)
    ends = rng.standard_normal((2, COUNT)) + 1j * rng.standard_normal((2, COUNT))
    a, b = (bearing.position for bearing in drops.machine().touchdown_bearings)
    share = np.array([(probe.position - a) / (b - a) for probe in drop.probes])[:, None]
    there = (1 - share) * ends[0] + share * ends[1]
    seen = clean_readings(there.real, there.imag, np.zeros(COUNT), drop.probes, chain)
    np.testing.assert_allclose((drop.axes @ there).real, seen, rtol=1e-10)
    np.testing.assert_allclose(drop.to_ends @ seen, ends, rtol=1e-10)


def test_what_is_left_knows_the_probes_as_the_model_has_them(crew: Crew) -> None:
    problem = problem_of(crew, speeds=((80.0, 1),))
    probe = problem.drops[0].probes[2]
    turned = replace(problem, standing=(parse(f"probe_angle:probe={probe.name},error=30 deg"),))
    plain = Contender((), turned, linearised(turned, turned.start, 0.006), 0.006, 0.9)
    (left,) = left_over(plain, 0.006)
    assert np.angle(left.axes[2, 2] * np.exp(1j * probe.angle)) == pytest.approx(np.radians(-30))
    ends = np.array([1e-6, 2e-6j])
    a, b = (bearing.position for bearing in problem.model.machine.touchdown_bearings)
    share = np.array([(each.position - a) / (b - a) for each in left.probes])
    seen = (left.axes @ ((1 - share) * ends[0] + share * ends[1])).real
    np.testing.assert_allclose(left.to_ends @ seen, ends, rtol=1e-10, atol=1e-16)


def test_three_probes_do_not_tell_the_ends() -> None:
    machine = drops.machine()
    for few in (machine.probes[:3], machine.probes[:2]):
        assert not to_ends(machine, few, seen_along(few, SensorChain())).any()


def test_what_is_louder_in_a_phase_is_found_there_and_nowhere_else() -> None:
    drop = bare(SIGMA)
    machine = drops.machine()
    rng = np.random.default_rng(2)
    left = SIGMA * rng.standard_normal((4, COUNT))
    first_contact = (drop.time >= 8e-3) & (drop.time <= 10e-3)
    left[0, first_contact] *= 20
    table = by_phase([replace(drop, measured=drop.simulated + left)], machine)
    name = drop.probes[0].name
    assert np.isnan(table[name][PHASES.index("levitated")])
    assert table[name][PHASES.index("first contact")] > 10
    assert table[name][PHASES.index("fall")] < 1.5 and table[name][PHASES.index("after")] < 1.5
    assert all(np.nanmax(table[probe.name]) < 1.6 for probe in drop.probes[1:])
    other = [probe.name for probe in drop.probes if probe.end == machine.ends[1]]
    assert all(np.isnan(table[name][2:]).all() for name in other)  # that end never touches: it falls all the time


def test_directions_follow_the_place_of_the_shaft() -> None:
    """A residual along the line from the bearing's centre is radial, one across it tangential, wherever the shaft is."""
    drop = bare(SIGMA)
    angle = np.linspace(0, 2 * np.pi, COUNT)
    place = 1e-4 * np.exp(1j * np.stack([angle, angle]))
    push = 5e-6 * np.exp(1j * angle)
    moved = replace(drop, place=place, measured=drop.simulated + _readings(drop, push, 1j * push))
    first, second = by_direction([moved])
    assert first[2] > 10 and first[3] < 1e-6 * first[2]
    assert second[3] > 10 and second[2] < 1e-6 * second[3]
    np.testing.assert_allclose(first[:2].mean(), first[2] / np.sqrt(2), rtol=0.02)  # it rotates: half in x, half in y
    lacking = moved.measured.copy()
    lacking[0, COUNT // 3 :] = np.nan  # the rest of its readings is missing, not equal to the simulated one
    fewer, _ = by_direction([replace(moved, measured=lacking)])
    assert fewer[2] == pytest.approx(first[2]) and fewer[3] < 1e-6 * fewer[2]
    blind = replace(moved, to_ends=np.zeros((2, 4), dtype=complex))
    assert np.isnan(by_direction([blind])).all()


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("order", [-2.0, 1.0, 3.0])
def test_a_whirl_is_found_at_its_order_with_its_amplitude(sense: int, order: float) -> None:
    """Whichever way the rotor turns, positive frequency is with the rotation."""
    drop = replace(bare(SIGMA), omega=sense * 2 * np.pi * SPEED)
    rng = np.random.default_rng(4)
    whirl = 3e-6 * np.exp(1j * order * drop.omega * drop.time)
    left = _readings(drop, whirl, np.zeros(COUNT)) + SIGMA * rng.standard_normal((4, COUNT))
    first, second = spectra(replace(drop, measured=drop.simulated + left), drops.machine())
    line = first.lines()[0]
    assert abs(line.frequency - order * SPEED) < first.resolution / 2
    assert line.amplitude == pytest.approx(3e-6, rel=0.16)  # a Hann window reads up to 15 % less between two bins
    assert ("backward" if order < 0 else "forward") in line.words
    assert not second.lines()


def test_a_line_at_standstill_is_of_no_order() -> None:
    drop = replace(bare(SIGMA), omega=0.0)
    whirl = 3e-6 * np.exp(2j * np.pi * SPEED * drop.time)
    first, _ = spectra(
        replace(drop, measured=drop.simulated + _readings(drop, whirl, np.zeros(COUNT))), drops.machine()
    )
    line = first.lines()[0]
    assert line.frequency == pytest.approx(SPEED, abs=first.resolution / 2)
    assert line.order is None
    assert line.order_words == "–"


def test_samples_that_a_probe_lacks_change_no_line() -> None:
    """Taken as zero they made a forward whirl smaller and added a backward one, since the end's other probe went on."""
    drop = bare(SIGMA)
    rng = np.random.default_rng(4)
    left = _readings(drop, 3e-6 * np.exp(1j * drop.omega * drop.time), np.zeros(COUNT))
    measured = drop.simulated + left + SIGMA * rng.standard_normal((4, COUNT))
    measured[0, -COUNT // 3 :] = np.nan
    first, _ = spectra(replace(drop, measured=measured), drops.machine())
    (line,) = first.lines()
    assert line.frequency == pytest.approx(SPEED, abs=first.resolution / 2)
    assert line.amplitude == pytest.approx(3e-6, rel=0.16)
    measured[1] = np.nan
    assert spectra(replace(drop, measured=measured), drops.machine()) == []


def test_noise_is_as_loud_as_it_is_said_to_be_and_shows_no_line() -> None:
    drop = bare(SIGMA)
    rng = np.random.default_rng(8)
    ratios, lines = [], 0
    for _ in range(60):
        left = SIGMA * rng.standard_normal((4, COUNT))
        for each in spectra(replace(drop, measured=drop.simulated + left), drops.machine()):
            ratios.append(np.mean(each.amplitude**2 / each.noise**2))
            lines += bool(each.lines())
    assert np.mean(ratios) == pytest.approx(1, abs=0.02)
    assert lines <= 6  # of 120 spectra one in a hundred is expected to pass


def test_the_slowest_the_fastest_and_one_between_are_shown() -> None:
    assert chosen([210.0, 60.0]) == (1, 0)
    assert chosen([210.0, 60.0, 100.0, 150.0, 80.0]) == (1, 2, 0)
