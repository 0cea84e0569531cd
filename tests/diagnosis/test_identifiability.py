"""What drops could show before any record, for suspects of the sensors and a few of the machine, which are quick to compute."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from tdbsim.effect import Parameter as Declared
from tdbsim.stated_effects import parse

from tdbmon.cli import main
from tdbmon.diagnosis.identifiability import ALIKE, DETECTABLE, Detectable, _smallest, identifiability
from tdbmon.diagnosis.identifiability_contract import identifiability_json, identifiability_lines
from tdbmon.diagnosis.score import FURTHEST
from tdbmon.diagnosis.suspects import suspects
from tdbmon.estimate import Estimate
from tdbmon.machine_file import with_effects
from tdbmon.shipped import shipped
from tests.identify import drops
from tests.json_page import documented

NOISE = 2e-6


@pytest.fixture(scope="module")
def among():
    machine = drops.machine()
    wanted = {"probe_gain@DE_A", "probe_gain@NDE_A", "oval_clearance@NDE", "off_sized_ball@DE"}
    found = [each for each in suspects(machine, machine.probes, ()) if each.name in wanted]
    gain = next(each for each in found if each.name == "probe_gain@DE_A")
    return [gain, *found]  # the gain of DE_A twice


@pytest.fixture(scope="module")
def found(among):
    return identifiability(drops.machine(), [100.0], NOISE, among=among)


def test_sizes_are_positive_and_known(found, among):
    assert {each.suspect.name for each in found.detectable} == {each.name for each in among}
    values = [each.size.value for each in found.detectable if each.size.known]
    # in one drop with this noise, an oval of either law may be too small to be seen
    assert {each.suspect.name for each in found.detectable if not each.size.known} <= {"oval_clearance@NDE"}
    assert min(values) > 0


def test_an_effect_looks_like_itself_and_not_like_another_probes_gain(found):
    similar = {(one.name, other.name): s for one, other, s in found.pairs}
    assert similar["probe_gain@DE_A", "probe_gain@DE_A"] == pytest.approx(1.0, abs=1e-9)
    assert all(s > ALIKE for s in similar.values())
    assert ("probe_gain@DE_A", "probe_gain@NDE_A") not in similar
    gain = next(each for each in found.detectable if each.suspect.name == "probe_gain@DE_A")
    assert gain.looks_like is not None
    assert gain.looks_like[0].name == "probe_gain@DE_A"


def test_no_further_drop_parts_an_effect_from_itself(found):
    assert found.next_drops
    assert all(left >= 1 for _, left in found.next_drops)


def test_a_gains_size_goes_with_the_noise(found, among):
    louder = identifiability(drops.machine(), [100.0], 2 * NOISE, among=among[:1])
    before = next(each.size.value for each in found.detectable if each.suspect.name == "probe_gain@DE_A")
    # priors of the machine's values do not grow with the noise, so the size falls a little short of twice
    assert louder.detectable[0].size.value / before == pytest.approx(2.0, rel=0.1)


def test_a_second_drop_shows_smaller_gains(found, among):
    both = identifiability(drops.machine(), [100.0, 150.0], NOISE, among=among[:1])
    assert both.detectable[0].size.value < next(
        each.size.value for each in found.detectable if each.suspect.name == "probe_gain@DE_A"
    )


def test_effects_that_the_machine_has_already_are_told(found):
    """Such effects act in the drops and are not tried at their place; the output did not say so."""
    oval = parse("oval_clearance:end=DE,amplitude=20 um,angle=35 deg")
    wider = replace(found, machine=with_effects(found.machine, [oval]))
    said = "already in the machine file, and not tried in the same place: oval clearance at DE (amplitude 20 um, angle 35 deg"
    assert identifiability_lines(wider)[1].startswith(said)
    (standing,) = identifiability_json(wider)["standing"]
    assert (standing["effect"], standing["where"]) == ("oval_clearance", "DE")
    assert not any("already" in line for line in identifiability_lines(found))


def test_json_and_lines_hold_every_size(found):
    content = json.loads(json.dumps(identifiability_json(found), allow_nan=False))
    assert set(content) == documented("identifiability")
    assert len(content["effects"]) == len(found.detectable)
    for each in content["effects"]:
        quantity = each["smallest_detectable"]
        assert quantity["value"] is not None or quantity["why"]
    lines = "\n".join(identifiability_lines(found))
    assert all(each.suspect.declared.identifier in lines for each in found.detectable)
    assert np.isclose(content["noise_um"], NOISE * 1e6)


def test_a_line_says_of_what_the_size_is_a_limit(found):
    gain = next(each for each in found.detectable if each.suspect.name == "probe_gain@NDE_A")
    oval = next(each for each in found.detectable if each.suspect.name == "oval_clearance@NDE")
    stiff = next(
        each for each in suspects(drops.machine(), drops.machine().probes, ()) if each.name == "foundation_mode@NDE"
    )
    support = Detectable(
        stiff, "stiffness", Estimate(7.615e9, unit="N/m", why="made up"), looks_like=(oval.suspect, 0.853)
    )
    made = replace(found, detectable=(gain, replace(oval, size=Estimate(114.1e-6, unit="um", why="made up")), support))
    head, *lines = identifiability_lines(made)[1:5]
    assert "similarity" in head
    assert f"|gain - 1| from about {float(f'{gain.size.value:.2g}'):g} " in lines[0]
    assert "amplitude from about 110 um " in lines[1]
    assert "stiffness up to about 7.6e+09 N/m" in lines[2]
    assert lines[2].index("0.85") == head.index("similarity")
    far = replace(made, detectable=(replace(support, suspect=replace(stiff, where="compressor wheel")), support))
    head, *lines = identifiability_lines(far)[1:4]  # a place name longer than its column ran into the size
    assert {line.index("stiffness") for line in lines} == {head.index("detectable")}


def test_long_cells_keep_the_columns_apart(found):
    """The output had `torque not to be seen so early up to 0.6 N m0.73`, and a cooling time of 20 without unit."""
    machine = drops.machine()
    growth = next(each for each in suspects(machine, machine.probes, ()) if each.name == "thermal_growth@NDE")
    unseen = Estimate.missing("nm/J", "made up")
    late = Detectable(growth, "growth", unseen, unseen=2.4e-8, looks_like=(growth, 0.73))
    head, line = identifiability_lines(replace(found, detectable=(late,)))[1:3]
    assert line.index("0.73") == head.index("similarity")
    assert "up to 24 nm/J  0.73" in line
    assert "thermal_growth (cooling_time 20 s)" in line


def test_drops_of_a_toothed_wheel_are_read(among):
    """Sixty pulses per revolution at 100 Hz are closer than samples resolve: without a speed channel no drop was read."""
    machine = drops.machine()
    wheel = machine.keyphasor.model_copy(update={"pulses_per_revolution": 60})
    found = identifiability(
        machine.model_copy(update={"keyphasor": wheel, "speed": None}), [100.0], NOISE, among=among[:1]
    )
    assert found.detectable[0].size.value is not None


def test_a_size_that_no_machine_has_is_not_told():
    """A ring's drag hardly shows in the first milliseconds: a linear extrapolation went to tens of N m."""
    machine = drops.machine()
    drag = [each for each in suspects(machine, machine.probes, ()) if each.name == "ring_drag@DE"]
    found = identifiability(machine, [100.0], NOISE, among=drag)
    (only,) = found.detectable
    assert only.size.value is None
    assert only.unseen is not None and 0 < only.unseen <= 5.0
    (told,) = identifiability_json(found)["effects"]
    assert "not detectable in the first contacts of these drops up to" in told["smallest_detectable"]["why"]
    assert told["may_show_later"]
    lines = "\n".join(identifiability_lines(found))
    assert f"torque not detectable so early up to {only.unseen:g} N m" in lines
    assert "rest of a record" in lines


@pytest.mark.parametrize(
    ("off", "low", "high", "typical", "length", "told"),
    [
        (0.0, 0.0, 2.0, 1.0, 4.0, 1.25),  # 1.25 trial sizes
        (0.0, 0.0, 2.0, 1.0, 2.0, 2.0),  # 2.5, beyond the catalogue's largest
        (0.0, 0.0, 50.0, 1.0, 1.0, 4.0),  # 5, beyond the limit of extrapolation
        (math.inf, 0.1, math.inf, 1.0, 10.0, 2.0),  # half a trial: a spring twice as stiff shows
        (math.inf, 0.5, math.inf, 1.0, 2.0, 0.5),
    ],
)
def test_a_size_is_told_up_to_the_bounds_and_to_what_is_believed(off, low, high, typical, length, told):
    declared = Declared(name="size", si="1", unit="1", off=off, low=low, high=high, typical=typical, meaning="made up")
    size, unseen = _smallest(declared, 1.0, length)
    assert (size.value if unseen is None else unseen) == pytest.approx(told)
    assert (size.value is None) == (DETECTABLE / length > min(FURTHEST, high if off == 0 else typical / low))


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--speed", "100 parsec"], "--speed 100 parsec"),
        (["--speed", "100"], "has no unit"),
        (["--speed", "-5 Hz"], "positive"),
        (["--speed", "100 Hz", "--noise", "0.3"], "has no unit"),
        (["--speed", "100 Hz", "--noise", "0 um"], "positive"),
        (["--speed", "100 Hz", "--noise", "0.3 kg"], "--noise 0.3 kg: 'kg'"),
        ([], "--speed"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_two(arguments, told, capsys):
    with pytest.raises(SystemExit) as end:
        main(["identifiability", str(shipped("short/machine.toml")), *arguments])
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_a_force_that_dies_at_once_is_a_later_release_but_for_the_square_of_its_time():
    """By a linear rule some microseconds of decay time should have shown; blind cases did not show two hundred."""
    machine = drops.machine()
    force = [
        each
        for each in suspects(machine, machine.probes, ())
        if each.name == "residual_magnetic_force@rotor" and each.held["law"] == "exponential"
    ]
    quiet, loud = (
        identifiability(machine, [100.0], noise, among=force).detectable[0].size for noise in (NOISE, 9 * NOISE)
    )
    assert loud.value / quiet.value == pytest.approx(3.0, rel=0.25)
    assert quiet.value > 2e-5
