"""Synthetic drops of machines unlike the shipped ones: heavy and soft, small and fast.  What the simulation knows is found."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.release import springing_back
from tdbmon.analysis.summary import summary_lines, weight
from tdbmon.figures.orbit_sequence import orbit_sequence
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.excursions import later_remarks
from tdbmon.quantity import printed
from tdbmon.record.assign import assign
from tdbmon.record.direction_checks import fall_directions
from tdbmon.report import build_report
from tdbmon.report.sections import whirl as whirl_section

MACHINES = Path(__file__).parent.parent / "machines"
RELEASE = 0.1  # s
SENSORS = SensorChain(probe=ProbeChain(noise=0.25e-6, hum=0.1e-6), speed_noise_hz=0.05, keyphasor_width=0.1)


def drop(machine, speed, seconds, seed=0):
    plan = DropPlan(speed, seconds, levitated=RELEASE, sensors=SENSORS, seed=seed)
    return simulate(machine, plan, bending=16)


@pytest.fixture(scope="module")
def compressor():
    return load_machine(MACHINES / "compressor_1500kg.toml")


@pytest.fixture(scope="module")
def expander():
    return load_machine(MACHINES / "expander_4kg.toml")


@pytest.mark.parametrize("speed", [50.0, 83.3, 108.0])
def test_a_heavy_rotor_that_bends_and_yields_is_let_go_when_it_was(compressor, speed):
    """Its sag springs back at 181 and 692 Hz, and it lies 1.4 gaps deep at the first turning point."""
    found = analyse(drop(compressor, speed, 0.12), compressor)
    release = found.release
    assert release.time.low <= RELEASE <= release.time.high
    assert release.time.value == pytest.approx(RELEASE, abs=4e-5)
    assert not release.force_decay.known
    assert not [check for check in found.checks if check.check == "free fall" and not check.passed]


def test_bending_modes_that_spring_back_are_the_first_and_the_low_ones(compressor, expander):
    from tdbsim.rotor import build_rotor

    heavy = springing_back(build_rotor(compressor))
    assert len(heavy) == 3 and heavy[0] < heavy[1] < heavy[2] < 1000.0
    light = springing_back(build_rotor(expander))
    assert len(light) == 1 and light[0] > 500.0


@pytest.fixture(scope="module")
def whirling(expander):
    """The shaft rolls right round its clearance against the rotation when the record ends."""
    record = drop(expander, 2000 / 3, 0.5)
    deep = np.hypot(record.shaft_x, record.shaft_y).values[:, record.time.values > 0.57]
    assert (np.median(deep, axis=1) > 1.1e-4).all()
    return analyse(record, expander)


def test_whirl_is_told_without_a_clearance_circle(whirling):
    assert not any(end.gap for end in whirling.ends.values())
    assert set(whirling.whirl) == {"E", "C"}
    for found in whirling.whirl.values():
        assert found.backward and found.full and found.drawn
        assert 0.3 < found.backward_onset.value < 0.55
        assert found.last_s > 0.55
        assert found.backward_longest_s > 0.15  # unequal quarter turns, on a path that is not round, make no end of it
    told = analysis_json(whirling)["whirl"]
    assert told["backward"] and told["full"]
    words = " ".join(str(block) for block in whirl_section.section(whirling).blocks)
    assert "the gap of the drawing" in words


def test_the_terminal_tells_backward_whirl_before_all_numbers(whirling):
    first, *lines = summary_lines(whirling)
    assert first.startswith("quality") and all("backward whirl" in line for line in lines[:2])
    for line, (end, found) in zip(lines, whirling.whirl.items(), strict=False):
        assert line.startswith(f"backward whirl, {end}") and f"[{found.backward_onset.value:.4f} s]" in line
        assert f"{found.backward_longest_s:.3g} s at {printed(found.longest_backward.frequency)}" in line
        assert "with the drawing's gap" in line


def test_turns_of_the_longest_whirl_are_drawn_without_a_clearance_circle(whirling):
    for end, found in whirling.whirl.items():
        first, whirl = orbit_sequence(whirling, end).axes
        assert "from the release on" in first.get_title() and "backward whirl" in whirl.get_title()
        (path,) = [line for line in whirl.lines if line.get_label() == "orbit"]
        turned = np.ptp(np.unwrap(np.angle(path.get_xdata() + 1j * path.get_ydata()))) / (2 * np.pi)
        assert turned == pytest.approx(4.0, abs=1.0)  # by the mean frequency of the whole whirl
        begin, stop = map(float, re.search(r"([\d.]+) to ([\d.]+) s", whirl.get_title()).groups())
        assert found.longest_backward.start_s < begin < stop < found.longest_backward.end_s


def test_a_shaft_that_whirls_is_not_at_rest_and_accuses_no_probe(whirling):
    assert not [check for check in whirling.checks if not check.passed]
    assert not [check for check in whirling.checks if check.check == "rest at the bottom"]
    for end in whirling.ends.values():
        assert end.contacts is None  # it fell 4.6 ms; the circle of the whirl told a first contact after 0.3 s
        assert "whirls" in end.unsettled or "lifts off" in end.unsettled


@pytest.fixture(scope="module")
def rolling(machine):
    """The shaft rolls round its clearance against the rotation from the first contacts on: dry friction, 200 Hz."""
    dry = [
        b.model_copy(update={"friction": b.friction.model_copy(update={"nominal": 0.6})})
        for b in machine.touchdown_bearings
    ]
    rough = machine.model_copy(update={"touchdown_bearings": tuple(dry)})
    low = ((0.0, -9e-5), (0.0, -9e-5))  # held below the middle: it whirls about a place above where it was
    record = simulate(rough, DropPlan(200.0, 0.5, levitated=RELEASE, sensors=SENSORS, set_point=low), bending=16)
    assert (np.hypot(record.shaft_x, record.shaft_y).values[:, record.time.values > RELEASE + 0.05] > 2e-4).all()
    return record, analyse(record, machine)


@pytest.mark.parametrize("last_s", np.linspace(0.3, 0.6, 13))
def test_probes_are_not_accused_of_where_a_whirl_is_when_a_record_ends(rolling, machine, last_s):
    """Wherever in its round the shaft is cut off, its last quarter tells no place of rest."""
    laid = assign(rolling[0].sel(time=slice(0, last_s)), machine)
    assert all(row.passed for row in fall_directions(laid, machine))


def test_the_whirl_is_why_no_circle_is_told(rolling):
    found = rolling[1]
    for end in found.ends.values():
        assert found.whirl[end.name].backward
        assert end.unsettled.startswith("the shaft whirls around its clearance to the end of the record")


def test_a_shaft_that_stands_upright_dates_no_release(expander):
    """Nothing pulls it to the bottom: with a push it whirls, and no force that decays in seconds is made of that."""
    upright = expander.model_copy(update={"gravity": 0.0})
    push = ((0.01, 0.005), (0.008, -0.004))
    plan = DropPlan(333.0, 0.3, levitated=RELEASE, sensors=SENSORS, velocity=push)
    record = simulate(upright, plan, bending=16)
    found = analyse(record, expander)
    assert not found.release.time.known and not found.release.force_decay.known
    assert "a vertical shaft does not fall" in found.release.time.why
    falls = [check for check in found.checks if check.check == "free fall"]
    assert falls and all("a vertical shaft" in check.detail for check in falls)
    with pytest.raises(InputError, match="a vertical shaft does not fall"):
        measured_drop(record, expander)


def test_forces_of_the_first_fifth_of_a_second_are_not_those_of_a_whirl_that_sets_in_later(expander):
    """The shaft presses with 2.4 kN on E after 0.3 s, with 0.4 kN before."""
    record = drop(expander, 2000 / 3, 0.5)
    late = record.time.values > RELEASE + 0.2
    assert record.normal_force.values[:, late].max() > 3 * record.normal_force.values[:, ~late].max()
    remarks = later_remarks(measured_drop(record, expander), expander)
    assert [remark.split(": ")[1] for remark in remarks] == ["E", "C"]
    assert all("may be far greater later" in remark for remark in remarks)
    slow = drop(expander, 200.0, 0.3)
    assert later_remarks(measured_drop(slow, expander), expander) == ()


def test_a_machine_without_probes_is_told_its_run_down_and_no_load(expander):
    """What a shaft that stands upright is sent to: it rests on no radial bearing, and nothing is wrong with the record."""
    slowing = drop(expander, 200.0, 0.5)
    found = analyse(slowing, expander.model_copy(update={"probes": ()}))
    assert found.rundown is not None
    (orbit,) = [check for check in found.checks if check.check == "orbit"]
    assert orbit.passed and "no probes" in orbit.detail
    assert weight(found) == f"{found.rotor.total_mass:.4g} kg by the machine file"
    words = "\n".join(summary_lines(found)) + str(build_report(found)) + json.dumps(analysis_json(found))
    assert "displacement probe of this machine" not in words
    assert not re.search(r"\d+ N on ", words)
    assert re.search(r"\d+ N on ", "\n".join(summary_lines(analyse(slowing, expander))))
