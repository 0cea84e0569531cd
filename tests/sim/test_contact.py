"""Contact and friction, law by law."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tdbsim import hooks
from tdbsim.columns import FRICTION_LOAD, FRICTION_POWER
from tdbsim.contact import elastic_force, normal_force, touch, touch_shaped
from tdbsim.drop_model import build_model
from tdbsim.effect import declaration
from tdbsim.friction import REGULAR_SLIP, friction_force
from tdbsim.power_law import REFERENCE_DEPTH, scaled_stiffness, static_depth
from tdbsim.rhs import contact_forces

AZIMUTHS = np.linspace(-math.pi, math.pi, 73)


@pytest.fixture(scope="module")
def arrays(machine):
    return build_model(machine).arrays


def test_elastic_force_is_a_power_of_depth():
    for depth in (1e-9, 1e-6, 7e-5):
        assert elastic_force(depth, 1.3e9, 1 / 9) == pytest.approx(1.3e9 * depth ** (10 / 9), rel=1e-13)
        assert elastic_force.py_func(depth, 1.3e9, 1 / 9) == pytest.approx(1.3e9 * depth ** (10 / 9), rel=1e-13)
    assert elastic_force(0.0, 1.3e9, 1 / 9) == elastic_force(-1e-6, 1.3e9, 1 / 9) == 0.0


def test_every_exponent_has_the_same_force_at_the_reference_depth():
    for exponent in (1.0, 10 / 9, 1.5):
        force = elastic_force(REFERENCE_DEPTH, scaled_stiffness(1.3e9, exponent), exponent - 1)
        assert force == pytest.approx(1.3e9 * REFERENCE_DEPTH ** (10 / 9), rel=1e-12)
        assert static_depth(force, 1.3e9, exponent) == pytest.approx(REFERENCE_DEPTH, rel=1e-12)


def test_normal_force_never_pulls():
    assert normal_force(1000.0, 0.2, 0.1) == pytest.approx(1000 * (1 + 1.5 * 0.1 * 0.2))
    assert normal_force(1000.0, -100.0, 0.1) == 0.0
    assert normal_force.py_func(1000.0, -100.0, 0.1) == 0.0


def test_restitution_of_hunt_and_crossley():
    """A mass thrown against the contact comes back with 1 - damping x speed of its speed, for small damping x speed.

    Hunt and Crossley (1975): e = 1 - alpha v with the damping factor 3/2 alpha; the next term is of order (alpha v)^2.
    """
    mass, damping = 5.0, 0.08
    for speed in (0.05, 0.1):
        depth, rate, step = 0.0, speed, 1e-7
        while True:
            middle = depth + 0.5 * step * rate
            force = normal_force(elastic_force(middle, 1.3e9, 1 / 9), rate, damping)
            rate -= step * force / mass
            depth = middle + 0.5 * step * rate
            if depth <= 0:
                break
        assert -rate / speed == pytest.approx(1 - damping * speed, abs=2 * (damping * speed) ** 2)


@pytest.mark.parametrize("azimuth", AZIMUTHS)
@pytest.mark.parametrize("compiled", [True, False])
def test_friction_acts_against_the_slip_and_tangentially(arrays, azimuth, compiled):
    law = contact_forces if compiled else contact_forces.py_func
    radius, gap = arrays.end[0, 1], arrays.end[0, 0]
    for omega, ring, vx, vy in ((900.0, 0.0, 0.0, 0.0), (-900.0, 100.0, 0.3, -0.2), (500.0, 700.0, -0.1, 0.4)):
        nx, ny = math.cos(azimuth), math.sin(azimuth)
        fx, fy, normal, rub, slip = law(arrays, 0, nx, ny, 3000.0, 0.0, vx, vy, omega, ring)
        tangential = -fx * ny + fy * nx
        assert fx * nx + fy * ny == pytest.approx(-normal, abs=1e-12 * normal)
        assert tangential == pytest.approx(rub, abs=1e-12 * normal)
        assert slip == pytest.approx(omega * radius - ring * (radius + gap) - vx * ny + vy * nx, rel=1e-12)
        assert abs(slip) > 1.0
        expected = -math.copysign(0.12 * normal, slip) * abs(slip) / math.hypot(slip, REGULAR_SLIP)
        assert tangential == pytest.approx(expected, rel=1e-12)
        assert tangential * slip < 0


def test_friction_through_zero_slip():
    none = np.zeros((3, hooks.row_length()))
    assert friction_force(1000.0, 0.0, 0.1, 0.0, none, 0) == 0.0
    slips = np.linspace(-1, 1, 401)
    forces = np.array([friction_force(1000.0, slip, 0.1, 0.0, none, 0) for slip in slips])
    assert np.all(np.diff(forces) < 0)
    assert np.all(forces * slips <= 0)
    assert np.abs(forces).max() < 100.0


def test_friction_that_falls_with_the_load(arrays):
    """At the rotor's weight the coefficient is the stated one; at a thousandth of it, with exponent 0.1, twice as large."""
    weight = arrays.end[0, FRICTION_LOAD]
    falling = arrays._replace(end=arrays.end.copy())
    falling.end[0, FRICTION_POWER] = 0.1
    for load, factor in ((weight, 1.0), (1e-3 * weight, 10**0.3), (1e3 * weight, 10**-0.3)):
        usual = contact_forces(arrays, 0, 1.0, 0.0, load, 0.0, 0.0, 0.0, 500.0, 0.0)[3]
        assert contact_forces(falling, 0, 1.0, 0.0, load, 0.0, 0.0, 0.0, 500.0, 0.0)[3] == pytest.approx(factor * usual)
    assert contact_forces(falling, 0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 500.0, 0.0)[3] == 0.0


def test_touch_of_a_round_bore():
    for azimuth in AZIMUTHS:
        nx, ny, depth = touch(3e-4 * math.cos(azimuth), 3e-4 * math.sin(azimuth), 2.5e-4)
        assert (nx, ny) == pytest.approx((math.cos(azimuth), math.sin(azimuth)), abs=1e-14)
        assert depth == pytest.approx(5e-5, rel=1e-12)
    assert touch(0.0, 0.0, 2.5e-4)[2] == -2.5e-4


def _row(machine, identifier, **values):
    model = build_model(machine, [declaration(identifier).at("NDE", values)])
    return model.arrays.effect[0]


@pytest.mark.parametrize(
    ("identifier", "values"),
    [
        ("oval_clearance", {"amplitude": 20e-6, "angle": 0.6, "law": "normal"}),
        ("ring_out_of_round", {"amplitude": 8e-6, "order": 3, "law": "normal"}),
    ],
)
def test_a_bore_that_is_not_round_has_a_potential(machine, identifier, values):
    """With the law "normal", normal and swing are the gradient of the depth: the elastic contact conserves energy."""
    p = _row(machine, identifier, **values)
    gap, step = 2.5e-4, 1e-9
    for azimuth in AZIMUTHS:
        ex, ey, ring = 2.7e-4 * math.cos(azimuth), 2.7e-4 * math.sin(azimuth), 0.4

        def depth(x, y, angle):
            return touch_shaped(x, y, gap, angle, 0.0, p)[2]

        nx, ny, _, swing = touch_shaped(ex, ey, gap, ring, 0.0, p)
        assert math.hypot(nx, ny) == pytest.approx(1.0)
        assert nx == pytest.approx((depth(ex + step, ey, ring) - depth(ex - step, ey, ring)) / 2 / step, abs=1e-5)
        assert ny == pytest.approx((depth(ex, ey + step, ring) - depth(ex, ey - step, ring)) / 2 / step, abs=1e-5)
        turned = (depth(ex, ey, ring + 1e-5) - depth(ex, ey, ring - 1e-5)) / 2e-5
        assert swing == pytest.approx(turned, abs=1e-9)


def test_the_radial_law_changes_the_distance_alone(machine):
    p = _row(machine, "oval_clearance", amplitude=20e-6, angle=0.6)
    for azimuth in AZIMUTHS:
        ex, ey = 2.7e-4 * math.cos(azimuth), 2.7e-4 * math.sin(azimuth)
        nx, ny, depth, swing = touch_shaped(ex, ey, 2.5e-4, 0.0, 0.0, p)
        assert (nx, ny) == pytest.approx((math.cos(azimuth), math.sin(azimuth)), abs=1e-12)
        assert depth == pytest.approx(2e-5 - 20e-6 * math.cos(2 * (azimuth - 0.6)), abs=1e-15)
        assert swing == 0.0


@pytest.mark.parametrize(
    ("identifier", "values", "gap"),
    [
        ("ring_out_of_round", {"amplitude": 10e-6, "order": 8, "law": "normal"}, 2.5e-4),
        ("ring_out_of_round", {"amplitude": 20e-6, "order": 5, "law": "normal"}, 2.5e-4),
        ("oval_clearance", {"amplitude": 40e-6, "angle": 0.6, "law": "normal"}, 6e-5),
    ],
)
def test_a_bore_with_sharp_lobes_is_met_at_the_nearest(machine, identifier, values, gap):
    """Where lobes are more sharply bent than the rotor it is near to several of them, and touches the nearest."""
    p = _row(machine, identifier, **values)
    around = np.linspace(-math.pi, math.pi, 7201)
    bore = np.array([gap + hooks.gap(each, 0.0, p)[0] + hooks.bore(each, p)[0] for each in around])
    for azimuth in AZIMUTHS + 0.01:
        x, y = 1.01 * gap * math.cos(azimuth), 1.01 * gap * math.sin(azimuth)
        nearest = np.max(x * np.cos(around) + y * np.sin(around) - bore)
        assert touch_shaped(x, y, gap, 0.0, 0.0, p)[2] == pytest.approx(nearest, abs=1e-9)
