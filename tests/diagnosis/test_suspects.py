"""The effects that a model could lack, and their places."""

import numpy as np
import pytest
from tdbsim.effect import catalogue
from tdbsim.machine import load_machine
from tdbsim.stated_effects import parse

from tdbmon.diagnosis.suspects import suspects
from tdbmon.shipped import shipped
from tests.identify import drops


def test_every_effect_is_a_suspect_everywhere():
    machine = load_machine(shipped("short/machine.toml"))
    found = suspects(machine, machine.probes, ())
    assert {s.declared.identifier for s in found} == {each.identifier for each in catalogue()}
    assert {s.where for s in found if s.declared.identifier == "probe_gain"} == {p.name for p in machine.probes}
    assert {s.where for s in found if s.declared.identifier == "oval_clearance"} == {"NDE", "DE"}


def test_a_law_of_windage_is_no_suspect_where_no_windage_is_stated():
    machine = load_machine(shipped("short/machine.toml"))
    without = machine.model_copy(update={"rotor": machine.rotor.model_copy(update={"speed_decay_time": None})})
    names, fewer = ({s.name for s in suspects(each, each.probes, ())} for each in (machine, without))
    assert names - fewer == {"quadratic_windage@rotor"}


def test_what_a_model_has_already_is_no_suspect():
    machine = load_machine(shipped("short/machine.toml"))
    standing = [parse("oval_clearance:end=NDE,amplitude=10 um"), parse("stribeck_friction:end=both,static_excess=0.1")]
    names = {s.name for s in suspects(machine, machine.probes, standing)}
    assert "oval_clearance@NDE" not in names
    assert "oval_clearance@DE" in names
    assert not any(name.startswith("stribeck") for name in names)


def test_a_probe_that_is_not_used_is_no_suspect():
    machine = load_machine(shipped("short/machine.toml"))
    names = {s.name for s in suspects(machine, [p for p in machine.probes if p.name != "NDE_B"], ())}
    assert "probe_gain@NDE_B" not in names
    assert "probe_crosstalk@NDE" not in names
    assert "probe_crosstalk@DE" in names


def test_what_acts_in_contacts_begins_at_its_usual_size_and_at_several_angles():
    machine = drops.machine()
    found = {s.name: s for s in suspects(machine, machine.probes, ())}
    angles = [start.shared["angle"] for start in found["oval_clearance@NDE"].usual()]
    assert np.degrees(angles) == pytest.approx([0, 45, 90, 135])
    assert {start.shared["amplitude"] for start in found["oval_clearance@NDE"].usual()} == {1.5e-5}
    assert len(found["hardening_support@both"].usual()) == 1
    # scores of all of these are linear in their values, or these differ from drop to drop
    assert not any(found[name].usual() for name in ("probe_gain@DE_A", "shaft_bow@rotor", "ring_out_of_round@DE"))


def test_waves_on_the_race_that_stands_still_have_one_phase_for_all_drops():
    machine = drops.machine()
    waves = [s for s in suspects(machine, machine.probes, ()) if s.name == "race_waviness@DE"]
    per_drop = {(s.held["race"], angle.per_drop) for s in waves for _, angle in s.sizes}
    assert per_drop == {("inner", True), ("outer", False)}
    assert {s.held["order"] for s in waves} == {2.0, 3.0, 4.0, 5.0, 6.0}
