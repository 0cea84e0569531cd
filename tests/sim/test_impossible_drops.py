"""Drops that cannot be simulated: each is refused with the value, its unit and the cure."""

from __future__ import annotations

import math

import numpy as np
import pytest
from changed_machine import changed, exactly
from tdbsim.columns import MAGNET_DAMPING, MAGNET_STIFFNESS
from tdbsim.drop_model import build_model
from tdbsim.effect import declaration
from tdbsim.ensemble import run_each
from tdbsim.errors import InputError
from tdbsim.simulate import DropPlan, run, simulate


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"speed": -50.0}, "speed -50 Hz must be not negative"),
        ({"speed": math.nan}, "speed nan is not finite; give a number in Hz"),
        ({"speed": "100 Hz"}, "speed '100 Hz' is not a number; give a number in Hz"),
        ({"speed": None}, "speed None is not a number"),
        ({"speed": True}, "speed True is not a number"),
        ({"speed": 100.0, "seconds": "0.2 s"}, "seconds '0.2 s' is not a number; give a number in s"),
        ({"speed": 100.0, "seconds": 0.0}, "seconds 0 s must be positive"),
        ({"speed": 100.0, "step": -1e-5}, "step"),
        ({"speed": 100.0, "sampling": 0.0}, "sampling"),
        ({"speed": 100.0, "levitated": -1.0}, "levitated"),
        ({"speed": 100.0, "seed": -1}, "-1 as a seed: impossible; give seed as a whole number, 0 or more"),
        ({"speed": 100.0, "method": "euler"}, "euler"),
        ({"speed": 100.0, "set_point": ((math.inf, 0.0), (0.0, 0.0))}, "set_point .* is not finite"),
        (
            {"speed": 100.0, "set_point": (0.0, -1e-4)},
            r"set_point .* has another form; give \(x, y\) for each end in m",
        ),
        ({"speed": 100.0, "set_point": ((0.0, 0.0), (0.0,))}, "set_point .* has another form"),
        ({"speed": 100.0, "ring_angle": 1.0}, "ring_angle 1.0 has another form; give a number for each end in rad"),
        ({"speed": 100.0, "shaft_angle": "3 deg"}, "shaft_angle '3 deg' is not a number; give a number in rad"),
        ({"speed": 100.0, "seconds": 1e-6}, "no sample"),
    ],
)
def test_impossible_plans(values, says):
    with pytest.raises(InputError, match=says):
        DropPlan(**values)


@pytest.mark.parametrize("bending", [-1, 2.5, True])
def test_impossible_numbers_of_modes(machine, bending):
    with pytest.raises(
        InputError, match=f"{bending} bending modes: impossible; give bending as a whole number, 0 or more"
    ):
        build_model(machine, bending=bending)


def test_a_shaft_that_stands_can_be_dropped(machine):
    """As `tdbmon simulate --speed "0 Hz"` does."""
    assert simulate(machine, DropPlan(0, 0.01)).rotor_speed.values[0] == 0.0


def test_no_rotor_turns_at_six_million_rpm(machine):
    with pytest.raises(InputError, match=r"speed 100000 Hz \(6e\+06 rpm\) .* no rotor withstands; is the unit right"):
        simulate(machine, DropPlan(1e5, 0.01))


def test_set_point_outside_the_gap(machine):
    with pytest.raises(InputError, match="reaches the gap of 250 um"):
        simulate(machine, DropPlan(100.0, 0.01, set_point=((0.0, -2.6e-4), (0.0, 0.0))))


@pytest.mark.parametrize("law", ["radial", "normal"])
def test_set_point_outside_a_gap_that_is_not_round(machine, law):
    """A drop began pressed into the narrow side of its bore; on the wide side one was refused that touches nothing."""
    oval = declaration("oval_clearance")
    across = oval.at("NDE", {"amplitude": 8e-5, "angle": 0.0, "law": law})
    upright = oval.at("NDE", {"amplitude": 8e-5, "angle": math.pi / 2, "law": law})
    low = DropPlan(100.0, 0.01, set_point=((0.0, -2e-4), (0.0, 0.0)))
    with pytest.raises(InputError, match=r"reaches the gap of 170\.?\d* um; that is the gap there with the effects"):
        simulate(machine, low, [across], 4)
    assert simulate(machine, low, [upright], 4).depth.values[0, 0] < 0
    lower = DropPlan(100.0, 0.01, set_point=((0.0, -3e-4), (0.0, 0.0)))
    hanging = simulate(machine, lower, [upright], 4).depth.values[0, 0]  # by the ring in its balls further off
    assert hanging == pytest.approx(-38e-6, abs=3e-6)
    with pytest.raises(InputError, match="reaches the gap"):
        simulate(machine, DropPlan(100.0, 0.01, set_point=((0.0, -3.5e-4), (0.0, 0.0))), [upright], 4)


@pytest.mark.parametrize("method", ["splitting", "dormand_prince"])
def test_heat_that_closes_the_gap(machine, method):
    """Beyond a gap of nought the rotor is stuck, and the numbers of a drop mean nothing."""
    plan = DropPlan(150.0, 0.1, method=method)
    model = build_model(machine, [declaration("thermal_growth").at("both", {"growth": 2e-6})], 4)
    says = r"thermal_growth has closed the gap of 250 um by 0\.\d+ s after the release, with [1-9]\d* J of frictional heat"
    with pytest.raises(InputError, match=says):
        run(model, plan)
    if method == "splitting":
        less = build_model(machine, [declaration("thermal_growth").at("both", {"growth": 2e-8})], 4)
        stuck, free = run_each([(model, plan), (less, plan)], lambda found: found)
        assert isinstance(stuck, InputError) and not isinstance(free, InputError)


def test_no_gap(machine):
    with pytest.raises(InputError, match="gap"):
        simulate(changed(machine, ends={"radial_gap": exactly(0.0)}), DropPlan(100.0, 0.01))


def test_no_magnets(machine):
    with pytest.raises(InputError, match="magnetic_bearing"):
        simulate(changed(machine, magnetic_bearings=()), DropPlan(100.0, 0.01))


def test_a_centre_of_mass_beyond_the_touchdown_bearings(machine):
    """One end of such a rotor would rest at the top of its bearing."""
    first, second = machine.touchdown_bearings
    near = first.model_copy(update={"position": second.position - 0.05})
    with pytest.raises(InputError, match="centre of mass, at .* mm, does not lie between the touchdown bearings"):
        simulate(machine.model_copy(update={"touchdown_bearings": (near, second)}), DropPlan(100.0, 0.01))


@pytest.mark.parametrize("feeds", ["cross-coupling", "magnets push away", "magnets drive"])
def test_whirl_that_grows_before_the_release(machine, feeds):
    model = build_model(machine)
    if feeds == "cross-coupling":
        model.arrays.circulatory[:2, :2] = 1e7 * np.eye(2)
    else:
        model.arrays.magnet[:, MAGNET_STIFFNESS if feeds == "magnets push away" else MAGNET_DAMPING] *= -1
    with pytest.raises(InputError, match="not stable at 150 Hz"):
        run(model, DropPlan(150.0, 0.01))


def test_steps_that_cannot_converge(machine):
    with pytest.raises(InputError, match="step"):
        simulate(machine, DropPlan(150.0, 0.1, step=1e-3, sampling=1e3))
    with pytest.raises(InputError, match="tolerance"):
        simulate(machine, DropPlan(150.0, 0.05, method="dormand_prince", tolerance=1e-30))


@pytest.mark.parametrize(
    ("ends", "what"),
    [
        ({"contact_stiffness": 1e18}, "contact_stiffness, contact_damping and inner_ring_mass"),
        ({"support_mass": 1e-9}, "support_damping and support_mass"),
    ],
)
def test_steps_that_would_take_hours(machine, ends, what):
    """As of a value in another unit: nothing told of it, and the drop went on and on."""
    with pytest.raises(InputError, match=f"'NDE': with its {what} a drop would need steps of .* s and hours to compute; check"):
        run(build_model(changed(machine, ends=ends)), DropPlan(100.0, 0.01))


def test_steps_that_would_take_hours_do_no_harm_to_other_drops(machine):
    plan, stiff = DropPlan(100.0, 0.01), changed(machine, ends={"contact_stiffness": 1e18})
    refused, done = run_each([(build_model(stiff), plan), (build_model(machine), plan)], lambda found: found.plan.speed)
    assert isinstance(refused, InputError) and done == 100.0


def test_a_record_that_no_memory_holds(machine):
    with pytest.raises(InputError, match=r"1e\+09 s at 20000 Hz are 2e\+13 samples, .* GB; .* simulate shorter"):
        simulate(machine, DropPlan(100.0, 1e9))
