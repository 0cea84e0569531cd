"""The machines of the source have the mass and the inertias that it prints, and drop."""

import numpy as np
import pytest
from tdbsim.hertz import BearingGeometry, Material
from tdbsim.machine import load_machine
from tdbsim.rotor import build_rotor
from tdbsim.simulate import DropPlan, simulate

from tdbmon.shipped import shipped

STEEL, CERAMIC = Material(200e9, 0.3), Material(315e9, 0.26)


@pytest.mark.parametrize(
    ("name", "mass", "polar", "diametral"),
    [("motor_6016", 97.3, 0.39, 2.82), ("motor_6014_71914", 109.7, 0.39, 4.5535)],
)
def test_rotors_weigh_and_turn_as_printed(name, mass, polar, diametral):
    rotor = build_rotor(load_machine(shipped(f"machines/{name}.toml")))
    assert rotor.total_mass == pytest.approx(mass, rel=1e-4)
    assert rotor.polar_inertia == pytest.approx(polar, rel=1e-4)
    assert rotor.diametral_inertia == pytest.approx(diametral, rel=1e-4)


@pytest.mark.parametrize(
    ("name", "end", "geometry", "share"),
    [
        ("motor_6016", "NDE", BearingGeometry(19.05e-3, 110e-3, ball=STEEL, race=STEEL), 1.0),
        ("motor_6014_71914", "NDE", BearingGeometry(12.303e-3, 90e-3, ball=CERAMIC, race=STEEL), 1.0),
        (
            "motor_6014_71914", "DE",
            BearingGeometry(9.525e-3, 85e-3, contact_angle=np.radians(25), ball=CERAMIC, race=STEEL),
            2 * np.cos(np.radians(25)) ** 2.5,
        ),
    ],
)  # fmt: skip
def test_balls_are_as_stiff_as_hertz_says(name, end, geometry, share):
    bearing = load_machine(shipped(f"machines/{name}.toml")).bearing(end)
    balls = bearing.balls
    assert bearing.ball_stiffness == pytest.approx(share * geometry.stiffness, rel=1e-4)
    assert balls.diameter == pytest.approx(geometry.ball_diameter)
    assert balls.pitch_diameter == pytest.approx(geometry.pitch_diameter)


@pytest.mark.parametrize("name", ["motor_6016", "motor_6014_71914", "generator_71914"])
def test_machines_drop_onto_both_bearings(name):
    machine = load_machine(shipped(f"machines/{name}.toml"))
    drop = simulate(machine, DropPlan(speed=100.0, seconds=0.03))
    assert np.all(drop["normal_force"].max("time") > 1000)
