"""Torque and heat in the bearing: the laws' own numbers, kinematics from rigid bodies, energy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad
from tdbsim.bearing_torque import TorqueLaw, ball_motion, race_heat, spin_moment
from tdbsim.errors import InputError
from tdbsim.hertz import BearingGeometry

ANGULAR = BearingGeometry(9.525e-3, 85e-3, contact_angle=math.radians(25))
DEEP = BearingGeometry(12.303e-3, 90e-3)
LAW = TorqueLaw(85e-3, 5e-4, 1.0, 15e-6)


def test_palmgrens_law_in_his_units():
    assert LAW.of_load(2000.0) == pytest.approx(5e-4 * 2000 * 0.085)
    # 15 cSt, 12000 rpm, 85 mm: 1e-7 (180000)^(2/3) 85^3 N mm
    assert LAW.of_speed(200.0) == pytest.approx(1e-7 * 180000 ** (2 / 3) * 85**3 * 1e-3)
    assert LAW.of_speed(1.0) == pytest.approx(160e-7 * 85**3 * 1e-3)
    assert LAW.of_speed(0.0) == 0


def test_the_two_branches_meet_where_the_law_changes():
    limit = 2000 / 15 / 60  # Hz
    below, above = LAW.of_speed([limit * (1 - 1e-9), limit * (1 + 1e-9)])
    assert above == pytest.approx(below, rel=0.01)  # 2000^(2/3) = 158.7, printed as 160


@given(st.floats(0, 40), st.floats(0.05, 0.25))
def test_balls_roll_without_sliding_on_both_races(angle, ratio):
    """Velocities of rigid bodies at the contacts, in the cage's frame; x radial, y tangential, z along the shaft."""
    geometry = BearingGeometry(ratio * 0.1, 0.1, contact_angle=math.radians(angle))
    motion = ball_motion(geometry)
    alpha = geometry.contact_angle
    normal = np.array([math.cos(alpha), 0, math.sin(alpha)])
    ball = motion.roll * np.array([math.sin(motion.pitch), 0, -math.cos(motion.pitch)])
    centre = np.array([0.05, 0, 0])
    for side, race, spin in ((1, -motion.cage, motion.spin_outer), (-1, 1 - motion.cage, motion.spin_inner)):
        arm = side * ratio * 0.05 * normal
        turning = np.array([0, 0, race])
        slide = np.cross(ball, arm) - np.cross(turning, centre + arm)
        np.testing.assert_allclose(slide, 0, atol=1e-14)
        assert abs((ball - turning) @ normal) == pytest.approx(abs(spin), abs=1e-12)
    assert motion.spin_outer == pytest.approx(0, abs=1e-12)
    assert motion.spin_inner == pytest.approx(math.sin(alpha), abs=1e-12)
    assert motion.cage == pytest.approx((1 - ratio * math.cos(alpha)) / 2)  # as inside a run


def test_spin_moment_is_friction_integrated_over_the_ellipse():
    """M = mu int p r dA with Hertz's pressure."""
    contact = DEEP.inner
    load, friction = 800.0, 0.07
    b, a = (float(axis) for axis in contact.semi_axes(load))
    peak = float(contact.peak_pressure(load))
    whole = dblquad(
        lambda r, t: (
            peak
            * math.sqrt(max(1 - r**2, 0))
            * r
            * math.hypot(a * math.cos(t), b * math.sin(t))
            * a
            * b
            * r
        ),
        0, 2 * math.pi, 0, 1,
    )[0]  # fmt: skip
    found = spin_moment(load, friction, float(max(contact.semi_axes(1.0))), contact.integrals[1])
    assert found == pytest.approx(friction * whole, rel=1e-6)


def test_heat_is_what_the_torque_takes_from_the_ring():
    loads = np.abs(np.random.default_rng(0).normal(size=(40, 23))) * 300
    speed = np.linspace(0, 250, 40)
    heat = race_heat(ANGULAR, LAW, loads, loads.sum(axis=1), speed, 0.05)
    # spin of outer-race control is paid for by the ring alone, at its own rate times sin(alpha)
    spin = np.sum(
        spin_moment(loads, 0.05, float(max(ANGULAR.inner.semi_axes(1.0))), ANGULAR.inner.integrals[1]), axis=1
    ) * math.sin(ANGULAR.contact_angle)
    np.testing.assert_allclose(heat.torque, LAW.total(loads.sum(axis=1), speed) + spin, rtol=1e-12)
    np.testing.assert_allclose(heat.inner + heat.outer, heat.torque * 2 * math.pi * speed, rtol=1e-12)
    assert heat.inner[0] == heat.outer[0] == 0


def test_nothing_spins_in_a_deep_groove_and_the_inner_race_is_the_cooler():
    loads = np.full((3, 11), 200.0)
    rough, smooth = (race_heat(DEEP, LAW, loads, 1000.0, [10.0, 50.0, 200.0], mu) for mu in (0.1, 0.0))
    np.testing.assert_array_equal(rough.inner, smooth.inner)
    assert np.all(rough.inner < rough.outer)
    assert rough.inner[0] / rough.outer[0] == pytest.approx((90 - 12.303) / (90 + 12.303))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: TorqueLaw(0.0, 1e-3, 1.0, 1e-5), "pitch_diameter 0 m"),
        (lambda: TorqueLaw(0.1, -1e-3, 1.0, 1e-5), "load_factor"),
        (lambda: race_heat(DEEP, LAW, [1.0], 1.0, 1.0, -0.1), "negative"),
    ],
)
def test_what_is_no_torque_law_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
