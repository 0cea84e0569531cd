"""Torque and heat in the bearing: the laws' own numbers, energy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad
from tdbsim.bearing_torque import TorqueLaw, race_shares, spin_moment, spin_per_press
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


def test_spin_of_two_rows_is_that_of_their_balls():
    """Each ball of a row carries its part of the radial load over cos(alpha), and spins at sin(alpha) of the ring's rate."""
    stiffness, press = 1.86e10, np.array([3e-6, 5e-6, 1e-6])
    inner, outer = spin_per_press(ANGULAR, 0.05, 2, stiffness)
    loads = stiffness * press**1.5 / 2 / math.cos(ANGULAR.contact_angle)
    moments = spin_moment(loads, 0.05, float(max(ANGULAR.inner.semi_axes(1.0))), ANGULAR.inner.integrals[1])
    expected = 2 * np.sum(moments) * math.sin(ANGULAR.contact_angle)
    assert inner * np.sum(press**2) == pytest.approx(expected)
    assert outer == pytest.approx(0, abs=1e-12 * inner)
    assert spin_per_press(DEEP, 0.1, 1, stiffness) == pytest.approx((0.0, 0.0), abs=1e-9)


@given(st.floats(0, 1), st.floats(0, 0.3), st.floats(0, 0.3), st.floats(0.05, 0.2))
def test_races_share_all_of_the_work(rolling, spin_inner, spin_outer, across):
    total = rolling + spin_inner + spin_outer
    inner, outer = race_shares.py_func(total, spin_inner, spin_outer, across)
    assert inner + outer == pytest.approx(1)
    assert inner * total == pytest.approx(rolling * (1 - across) / 2 + spin_inner)


def test_without_spin_the_inner_race_is_the_cooler():
    inner, outer = race_shares.py_func(0.2, 0.0, 0.0, 12.303 / 90)
    assert inner / outer == pytest.approx((90 - 12.303) / (90 + 12.303))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: TorqueLaw(0.0, 1e-3, 1.0, 1e-5), "pitch_diameter 0 m"),
        (lambda: TorqueLaw(0.1, -1e-3, 1.0, 1e-5), "load_factor"),
        (lambda: spin_per_press(DEEP, -0.1, 1, 1e10), "negative"),
    ],
)
def test_what_is_no_torque_law_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
