"""The drop that the command line simulates, on a small fast rotor: its first blow is converged, its keyphasor is seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tdbsim.errors import InputError
from tdbsim.machine import Tolerant, load_machine
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.analyse import analyse
from tdbmon.progress import silent
from tdbmon.record.assign import assign
from tdbmon.record.keyphasor import pulses
from tdbmon.simulation import simulate_drop, simulation_json, simulation_lines

EXPANDER = Path(__file__).parent / "machines" / "expander_4kg.toml"


@pytest.fixture(scope="module")
def expander():
    return load_machine(EXPANDER)


def test_peak_forces_on_a_light_rotor_are_those_of_many_modes(expander):
    """With four bending modes the first blow on E is 12 % harder."""
    drop = simulate_drop(expander, "40000 rpm", "0.02", (), 0, silent)
    exact = simulate(expander, DropPlan(2000 / 3, 0.02, levitated=0.1), bending=24)
    assert drop.peak_normal_force.values == pytest.approx(exact.peak_normal_force.values, rel=0.02)


@pytest.mark.parametrize("compiled", [True, False])
def test_the_first_run_says_that_it_compiles_and_how_long_that_takes(compiled, expander, monkeypatch):
    told = []
    monkeypatch.setattr("tdbmon.simulation.is_compiled", lambda kernel: compiled)
    monkeypatch.setattr("tdbmon.simulation.simulate", lambda *given: None)
    simulate_drop(expander, "40000 rpm", "0.02", (), 0, told.append)
    assert [("up to a minute" in each) for each in told] == [not compiled]


def test_every_turn_of_a_fast_rotor_leaves_a_pulse(expander):
    drop = simulate_drop(expander, "50000 rpm", "0.02", (), 0, silent)
    turns = np.ptp(drop.shaft_angle.values) / (2 * np.pi)
    rising = np.count_nonzero(np.diff(drop.KPH.values) > 0.5)
    assert rising == pytest.approx(turns, abs=1.0)


def test_every_tooth_of_a_wheel_leaves_a_pulse(expander):
    """Of sixty teeth at 100 Hz two pulses were seen in three hundred; at 700 Hz they need a faster sampling."""
    toothed = expander.model_copy(
        update={"keyphasor": expander.keyphasor.model_copy(update={"pulses_per_revolution": 60})}
    )
    for speed in ("100 Hz", "700 Hz"):
        drop = simulate_drop(toothed, speed, "0.02", (), 0, silent)
        assert pulses(assign(drop, toothed), toothed).missed == 0
        turns = np.ptp(drop.shaft_angle.values) / (2 * np.pi)
        assert np.count_nonzero(np.diff(drop.KPH.values) > 0.5) == pytest.approx(60 * turns, abs=1.0)


def test_probes_of_a_wide_gap_do_not_clip(expander):
    """The converter's range was 1 mm, whatever the gap."""
    bearings = tuple(
        each.model_copy(update={"radial_gap": Tolerant(nominal=1.1e-3, low=1.1e-3, high=1.1e-3)})
        for each in expander.touchdown_bearings
    )
    wide = expander.model_copy(update={"touchdown_bearings": bearings})
    drop = simulate_drop(wide, "10000 rpm", "0.08", (), 0, silent)
    low, high = drop.EY.attrs["full_scale"]
    assert drop.EY.values.min() < -1e-3
    assert low < drop.EY.values.min() < drop.EY.values.max() < high


@pytest.mark.parametrize(("seconds", "short"), [("0.05", True), ("0.4", False)])
def test_a_record_too_short_for_a_circle_is_told_before_it_is_analysed(seconds, short, expander):
    """The command of the README made one of which `analyse` told neither radius, gap, contact nor stiffness."""
    drop = simulate_drop(expander, "10000 rpm", seconds, (), 0, silent)
    told = [line for line in simulation_lines(drop, expander, ()) if "analyse cannot estimate" in line]
    assert len(told) == short and all("of E and C from" in line and "--seconds 2" in line for line in told)
    found = analyse(drop, expander).ends.values()
    assert [end.gap is None and not end.stiffness.known for end in found] == [short, short]


def test_a_shaft_that_does_not_touch_brings_no_ring_to_speed(expander):
    drop = simulate_drop(expander, "10000 rpm", "2 ms", (), 0, silent)
    said = "\n".join(simulation_lines(drop, expander, ()))
    assert said.count("the shaft does not touch the ring within the simulated time") == 2


def test_a_ring_that_rolls_in_a_wide_gap_turns_with_the_journal(expander):
    """Without slip it turns at 97.6 % of the shaft's speed, and was said never to come to it."""
    gap, drag = Tolerant(nominal=300e-6, low=300e-6, high=300e-6), Tolerant(nominal=1e-4, low=1e-4, high=1e-4)
    bearings = tuple(
        each.model_copy(update={"radial_gap": gap, "inner_ring_drag": drag}) for each in expander.touchdown_bearings
    )
    wide = expander.model_copy(update={"touchdown_bearings": bearings})
    drop = simulate_drop(wide, "20000 rpm", "0.6", (), 0, silent)
    for i, (end, numbers) in enumerate(simulation_json(drop, wide)["ends"].items()):
        bearing = wide.bearing(end)
        rolling = drop.rotor_speed * bearing.journal_radius / (bearing.journal_radius + 300e-6)
        at = float(drop.time[int((drop.ring_speed[i] >= 0.98 * rolling).values.argmax())])
        assert drop.attrs["release_time_s"] < numbers["ring_at_speed_s"]["value"] == pytest.approx(at, abs=1e-9)


def test_a_balls_peak_is_said_to_be_that_of_the_samples(expander):
    """The force beside it is that of all steps; on a rotor of 3 kg the load sampled at 20 kHz was 4 % lower than at 200 kHz."""
    drop = simulate_drop(expander, "10000 rpm", "0.02", (), 0, silent)
    assert "\n".join(simulation_lines(drop, expander, ())).count("peak ball load, sampled") == 2
    assert "of the record's samples" in simulation_json(drop, expander)["ends"]["E"]["peak_ball_load_n"]["why"]


def test_the_record_is_sampled_as_asked(expander):
    drop = simulate_drop(expander, "10000 rpm", "2 ms", (), 0, silent, sampling="50 kHz")
    assert np.diff(drop.time.values) == pytest.approx(2e-5)
    with pytest.raises(InputError, match="--sampling 50 has no unit"):
        simulate_drop(expander, "10000 rpm", "2 ms", (), 0, silent, sampling="50")


def test_the_record_says_how_it_was_made(expander):
    drop = simulate_drop(expander, "10000 rpm", "2 ms", (), 7, silent)
    assert drop.attrs["speed_hz"] == pytest.approx(10000 / 60)
    assert drop.attrs["seed"] == 7
    assert drop.attrs["bending_modes"] == 16


def test_an_effect_given_again_is_told(expander):
    """Two bows are one of their sum; who meant the second in place of the first must see it."""
    bows = ("shaft_bow:bow=4 um", "shaft_bow:bow=3 um", "unbalance:plane=impeller,amount=1 g mm")
    plane = expander.rotor.unbalance[0].name
    given = [each.replace("impeller", plane) for each in bows]
    drop = simulate_drop(expander, "10000 rpm", "0.001", given, 0, silent)
    told = [line for line in simulation_lines(drop, expander, given) if "times for" in line]
    assert told == ["shaft_bow is given 2 times for 'rotor', machine file included: all of them act together"]
