"""Angular contact against closed forms, its own potential and what is known of pairs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from tdbsim.angular_contact import AngularContactBearing, Row, pair, single
from tdbsim.ball_load import BallRow
from tdbsim.errors import InputError
from tdbsim.hertz import BearingGeometry

G71914 = BearingGeometry(9.525e-3, 85e-3, 0.52, 0.53, math.radians(25))
COUNT = 23
DEEP = BearingGeometry(12e-3, 90e-3)


def axially_loaded(geometry, count, force):
    """Contact angle and deflection from F/(Z K A^1.5) = sin a (cos a0/cos a - 1)^1.5 (Harris, thrust-loaded row)."""
    apart = (geometry.inner_conformity + geometry.outer_conformity - 1) * geometry.ball_diameter
    free = geometry.contact_angle
    target = force / (count * geometry.stiffness * apart**1.5)
    angle = brentq(
        lambda a: math.sin(a) * (math.cos(free) / math.cos(a) - 1) ** 1.5 - target, free + 1e-14, 1.5, xtol=1e-15
    )
    return angle, apart * math.sin(angle - free) / math.cos(angle)


@pytest.mark.parametrize("force", [1.0, 100.0, 3000.0, 30000.0])
def test_axial_load_alone_follows_the_implicit_equation(force):
    bearing = single(G71914, COUNT)
    angle, deflection = axially_loaded(G71914, COUNT, force)
    where = bearing.loaded([0, 0, force, 0, 0], 0.1)
    np.testing.assert_allclose(where, [0, 0, deflection, 0, 0], rtol=1e-8, atol=1e-8 * deflection)
    (loads,) = bearing.displaced(where, 0.1)
    np.testing.assert_allclose(loads.contact_angle, angle, rtol=1e-9)
    np.testing.assert_allclose(loads.load, force / (COUNT * math.sin(angle)), rtol=1e-8)
    assert angle > G71914.contact_angle


def test_deep_groove_takes_its_contact_angle_from_the_clearance():
    """cos(alpha) = 1 - c_d/(2 A) where all play is taken up axially (Harris)."""
    clearance = 20e-6
    bearing = single(DEEP, 11, clearance)
    where = bearing.loaded([0, 0, 0.01, 0, 0])
    (loads,) = bearing.displaced(where)
    free = math.acos(1 - clearance / (2 * bearing.rows[0].centre_distance))
    np.testing.assert_allclose(loads.contact_angle, free, rtol=1e-3)
    back = bearing.loaded([0, 0, -0.01, 0, 0])
    np.testing.assert_allclose(back, -where, rtol=1e-9, atol=1e-15)  # it carries both ways


def test_radial_load_without_axial_freedom_is_the_deep_groove_row():
    rows = BallRow(DEEP, 11, 20e-6).displaced((14e-6, -21e-6), 0.3)
    (loads,) = single(DEEP, 11, 20e-6).displaced([14e-6, -21e-6, 0, 0, 0], 0.3)
    np.testing.assert_allclose(loads.load, rows.load, rtol=1e-9)


def test_radial_load_without_clearance_is_stribecks():
    count = 200
    beta = np.linspace(-math.pi / 2, math.pi / 2, 20001)
    integral = np.trapezoid(np.cos(beta) ** 2.5, beta) / (2 * math.pi)
    bearing = single(BearingGeometry(12e-3, 2.0), count)
    (loads,) = bearing.displaced(bearing.loaded([0, -4000.0, 0, 0, 0]))
    assert loads.load.max() == pytest.approx(4000 / (count * integral), rel=1e-6)


BEARINGS = {
    "single": single(G71914, COUNT),
    "X": pair(G71914, COUNT, 16e-3, "X", 4e-6),
    "O": pair(G71914, COUNT, 16e-3, "O", 4e-6),
    "play": pair(G71914, COUNT, 16e-3, "X", -6e-6),
    "tandem": pair(G71914, COUNT, 16e-3, "tandem"),
}


def potential(bearing, where, cage_angle=0.0):
    """Return the elastic energy of the balls, J: the work of each load K press^1.5."""
    rows = bearing.displaced(where, cage_angle)
    return sum(0.4 * np.sum(row.load * np.maximum(row.press, 0), axis=-1) for row in rows)


@pytest.mark.parametrize("name", BEARINGS)
def test_force_is_the_gradient_of_the_potential(name):
    bearing = BEARINGS[name]
    rng = np.random.default_rng(3)
    scale = np.array([20e-6, 20e-6, 20e-6, 3e-4, 3e-4])
    where = rng.normal(size=(20, 5)) * scale
    steps = np.diag(scale) * 1e-4
    slope = np.stack(
        [(potential(bearing, where + h, 0.2) - potential(bearing, where - h, 0.2)) / (2 * h.sum()) for h in steps],
        axis=-1,
    )
    force = bearing.force(where, 0.2)
    assert np.all(np.abs(force).max(axis=0) * scale > 1e-3)  # every component acts
    np.testing.assert_allclose(slope * scale, force * scale, rtol=1e-5, atol=1e-5 * np.abs(force * scale).max())


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["X", "O", "play"]))
def test_pairs_balance_any_load_to_nine_digits(seed, name):
    rng = np.random.default_rng(seed)
    bearing = BEARINGS[name]
    load = rng.normal(size=(12, 5)) * [2000, 2000, 1000, 10, 10]
    cage = rng.uniform(0, 6, 12)
    where = bearing.loaded(load, cage)
    radius = np.array([1, 1, 1, 0.0425, 0.0425])
    carried = sum(row.load.sum(axis=-1) for row in bearing.displaced(where, cage))
    assert np.all(np.linalg.norm((bearing.force(where, cage) - load) / radius, axis=1) <= 1e-9 * carried)


def test_turning_everything_turns_the_displacement():
    bearing, turn = BEARINGS["X"], 1.1
    load = np.array([500.0, -900.0, 200.0, 4.0, -2.0])

    def turned(v):
        c, s = math.cos(turn), math.sin(turn)
        return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1], v[2], c * v[3] - s * v[4], s * v[3] + c * v[4]])

    np.testing.assert_allclose(
        bearing.loaded(turned(load), turn), turned(bearing.loaded(load, 0.0)), rtol=1e-7, atol=1e-13
    )


def test_contact_angle_varies_around_a_tilted_ring():
    (loads,) = BEARINGS["single"].displaced([0, 0, 10e-6, 2e-4, 0])
    tilt_up = np.sin(2 * math.pi * np.arange(COUNT) / COUNT)
    assert np.corrcoef(tilt_up, loads.contact_angle)[0, 1] > 0.99
    (level,) = BEARINGS["single"].displaced([0, 0, 10e-6, 0, 0])
    assert np.ptp(level.contact_angle) < 1e-12


def test_back_to_back_resists_tilt_and_face_to_face_gives_way():
    tilt = [0, 0, 0, 1e-5, 0]
    moment = {name: BEARINGS[name].force(tilt)[3] for name in ("X", "O")}
    assert moment["O"] > 1.5 * moment["X"] > 0


def test_pairs_carry_both_ways_and_a_row_only_one():
    for name in ("X", "O"):
        there, back = (BEARINGS[name].loaded([0, 0, force, 0, 0])[2] for force in (500.0, -500.0))
        assert there == pytest.approx(-back, rel=1e-9)
    with pytest.raises(InputError, match="cannot carry"):
        BEARINGS["single"].loaded([0, 0, -500.0, 0, 0])


def test_tandem_shares_the_axial_load():
    where = BEARINGS["tandem"].loaded([0, 0, 2000.0, 0, 0])
    alone = BEARINGS["single"].loaded([0, 0, 1000.0, 0, 0])
    assert where[2] == pytest.approx(alone[2], rel=1e-8)


def test_clamping_loads_both_rows_as_an_axial_force_would():
    bearing = BEARINGS["O"]
    np.testing.assert_allclose(bearing.loaded(np.zeros(5)), 0, atol=1e-15)
    first, second = bearing.displaced(np.zeros(5))
    np.testing.assert_allclose(first.load, second.load, rtol=1e-12)
    clamp = float(np.sum(first.load * np.sin(first.contact_angle)))
    assert axially_loaded(G71914, COUNT, clamp)[1] == pytest.approx(2e-6, rel=1e-9)


def test_play_is_free():
    assert potential(BEARINGS["play"], [0, 0, 2.9e-6, 0, 0]) == 0
    assert potential(BEARINGS["play"], [0, 0, 3.1e-6, 0, 0]) > 0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: pair(G71914, COUNT, 16e-3, "tandem", 1e-6), "tandem"),
        (lambda: pair(G71914, COUNT, 16e-3, "H"), "X, O or tandem"),
        (lambda: pair(G71914, COUNT, 0.0, "X"), "spacing"),
        (lambda: Row(G71914, 2), "2 balls"),
        (lambda: Row(G71914, COUNT, sense=0), "sense 0"),
        (lambda: AngularContactBearing(()), "at least one row"),
        (lambda: BEARINGS["X"].loaded([0, 0, 1]), "five finite"),
    ],
)
def test_what_is_no_bearing_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
