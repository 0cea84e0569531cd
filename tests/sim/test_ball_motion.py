"""Kinematics of balls and cage, from rigid bodies; the simulator's cages turn by it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.ball_motion import ball_motion
from tdbsim.columns import CAGE_RATIO
from tdbsim.drop_model import build_model
from tdbsim.hertz import BearingGeometry
from tdbsim.machine import load_machine
from tdbsim.simulate import DropPlan, simulate

from tdbmon.shipped import shipped


@given(st.floats(0, 40), st.floats(0.05, 0.25))
def test_balls_roll_without_sliding_on_both_races(angle, ratio):
    """Velocities of rigid bodies at the contacts, in the cage's frame; x radial, y tangential, z along the shaft."""
    geometry = BearingGeometry(ratio * 0.1, 0.1, contact_angle=math.radians(angle))
    motion = ball_motion(geometry)
    alpha = geometry.contact_angle
    normal = np.array([math.cos(alpha), 0, math.sin(alpha)])
    pitch = math.atan2(
        math.sin(alpha), math.cos(alpha) + ratio
    )  # of the ball's axis, with which it spins on one race only
    ball = motion.roll * np.array([math.sin(pitch), 0, -math.cos(pitch)])
    centre = np.array([0.05, 0, 0])
    for side, race, spin in ((1, -motion.cage, motion.spin_outer), (-1, motion.ring, motion.spin_inner)):
        arm = side * ratio * 0.05 * normal
        turning = np.array([0, 0, race])
        slide = np.cross(ball, arm) - np.cross(turning, centre + arm)
        np.testing.assert_allclose(slide, 0, atol=1e-14)
        assert abs((ball - turning) @ normal) == pytest.approx(abs(spin), abs=1e-12)
    assert motion.spin_outer == pytest.approx(0, abs=1e-12)
    assert motion.spin_inner == pytest.approx(math.sin(alpha), abs=1e-12)
    assert motion.cage + motion.ring == pytest.approx(1)  # the inner ring turns once


@pytest.mark.parametrize(
    ("name", "ratio"), [("coastdown/machine.toml", None), ("machines/generator_71914.toml", 0.44922)]
)
def test_cages_turn_by_it_in_a_drop(name, ratio):
    """Deep groove, and 25 deg: (1 - 9.525 cos(25 deg)/85)/2; without the angle the cage would be 1.2 % slower."""
    machine = load_machine(shipped(name))
    motions = [ball_motion(bearing.geometry) for bearing in machine.touchdown_bearings]
    np.testing.assert_array_equal(build_model(machine).arrays.end[:, CAGE_RATIO], [motion.cage for motion in motions])
    for motion, bearing in zip(motions, machine.touchdown_bearings, strict=True):
        balls = bearing.balls
        bare = balls.diameter / balls.pitch_diameter
        assert motion.cage == pytest.approx(ratio or (1 - bare) / 2, abs=5e-6)
    drop = simulate(machine, DropPlan(100.0, 0.03))
    turned = [np.ptp(drop[angle].values, axis=1) for angle in ("cage_angle", "ring_angle")]
    assert turned[1].min() > 1.0
    np.testing.assert_allclose(turned[0] / turned[1], [motion.cage for motion in motions], rtol=1e-9)
