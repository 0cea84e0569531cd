"""Ball loads at rest: balance, symmetry, closed forms, and the same physics as inside a run."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from tdbsim import ball_bearing
from tdbsim.ball_load import BallRow, Wave, off_sized
from tdbsim.errors import InputError
from tdbsim.hertz import BearingGeometry, Material

STEEL = Material(200e9, 0.3)
G6016 = BearingGeometry(19.05e-3, 110e-3, 0.52, 0.52, ball=STEEL, race=STEEL)
ROW = BallRow(G6016, 10, 15e-6)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(3, 23), st.floats(-20e-6, 60e-6))
def test_the_balls_balance_the_load_to_nine_digits(seed, count, clearance):
    rng = np.random.default_rng(seed)
    row = BallRow(
        G6016, count, clearance, tuple(rng.uniform(-5e-6, 5e-6, count)), (Wave(2e-6, 2), Wave(1e-6, 3, 0.4, "outer"))
    )
    force = rng.normal(size=(50, 2)) * 10 ** rng.uniform(0, 4, (50, 1))
    loads = row.loaded(force, rng.uniform(0, 7, 50), rng.uniform(0, 7, 50))
    size = np.maximum(np.linalg.norm(force, axis=1), loads.load.sum(axis=1))
    assert np.all(np.linalg.norm(loads.force - force, axis=1) <= 1e-9 * size)
    assert np.all(loads.load >= 0)
    assert np.all((loads.load > 0) == (loads.press > 0))


def test_balance_is_the_least_potential_found_by_another_method():
    row = ROW.with_oversize(5e-6, 2, 9).with_oversize(-3e-6, 7)
    force = np.array([300.0, -1700.0])
    azimuth = row.azimuth(0.2)

    def potential(where):
        press = np.maximum(row.interference(azimuth) + 1e-6 * (where @ np.array([np.cos(azimuth), np.sin(azimuth)])), 0)
        return 0.4 * np.sum(row.stiffness * press**2.5) - 1e-6 * where @ force

    other = minimize(potential, [0.0, -20.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15})
    np.testing.assert_allclose(row.loaded(force, 0.2).displacement, 1e-6 * other.x, atol=1e-12)


def test_turning_cage_and_load_turns_everything():
    row = ROW.with_oversize(5e-6, 8)
    angle = np.linspace(0, 2 * math.pi, 31)
    force = 1700 * np.stack([np.cos(angle - 1.7), np.sin(angle - 1.7)], axis=-1)
    loads = row.loaded(force, angle)
    np.testing.assert_allclose(loads.load, np.broadcast_to(loads.load[0], loads.load.shape), rtol=1e-8, atol=1e-7)


def test_nominal_balls_repeat_after_their_spacing_and_mirror_about_the_load():
    spacing = 2 * math.pi / 10
    down = np.array([0.0, -2000.0])
    first, next_ = ROW.loaded(down, 0.1), ROW.loaded(down, 0.1 + spacing)
    np.testing.assert_allclose(next_.load, np.roll(first.load, -1), rtol=1e-9, atol=1e-8)
    ahead, behind = (ROW.loaded(down, -math.pi / 2 + s * 0.1).load for s in (1, -1))
    np.testing.assert_allclose(ahead, np.roll(behind[::-1], 1), rtol=1e-9, atol=1e-8)


def test_waves_of_the_inner_race_turn_with_the_ring_and_those_of_the_outer_do_not():
    inner = BallRow(G6016, 10, 15e-6, waves=(Wave(3e-6, 2),))
    outer = BallRow(G6016, 10, 15e-6, waves=(Wave(3e-6, 2, race="outer"),))
    push = (20e-6, 0.0)
    turned = inner.displaced(push, ring_angle=np.array([0.0, 0.3, math.pi]))
    assert not np.allclose(turned.load[0], turned.load[1])
    np.testing.assert_allclose(turned.load[0], turned.load[2], rtol=1e-12)  # two waves: half a turn is a turn
    fixed = outer.displaced(push, ring_angle=np.array([0.0, 0.3]))
    np.testing.assert_array_equal(fixed.load[0], fixed.load[1])
    np.testing.assert_array_equal(fixed.load[0], turned.load[0])


def test_without_imperfection_it_is_the_ideal_bearing_to_the_last_bit():
    force = np.array([[100.0, -900.0], [-4000.0, 30.0]])
    ideal = ROW.loaded(force, 0.3)
    zeroed = BallRow(G6016, 10, 15e-6, (0.0,) * 10, (Wave(0.0, 2), Wave(0.0, 3, 1.0, "outer"))).loaded(force, 0.3, 0.7)
    for name in ("displacement", "press", "load"):
        np.testing.assert_array_equal(getattr(ideal, name), getattr(zeroed, name))


def test_it_is_what_the_run_computes():
    """The force of the kernels, on the same displacement; there all balls have one stiffness."""
    azimuth = 2 * math.pi * np.arange(10) / 10
    sizes = np.zeros((2, 10))
    kernel = ball_bearing.ring_force.py_func
    force = kernel(
        11e-6, -23e-6, 10, G6016.stiffness, 7.5e-6, math.cos(0.4), math.sin(0.4),
        np.tile(np.cos(azimuth), (2, 1)), np.tile(np.sin(azimuth), (2, 1)), sizes, 0,
    )  # fmt: skip
    np.testing.assert_allclose(-np.array(force), ROW.displaced((11e-6, -23e-6), 0.4).force, rtol=1e-12)


def test_stribecks_distribution_without_clearance():
    """Q_max = F/(Z J_r), J_r(0.5) = (1/2 pi) int cos^(5/2) over the loaded half (R. Stribeck; H. Sjövall)."""
    row = BallRow(G6016, 300)
    beta = np.linspace(-math.pi / 2, math.pi / 2, 20001)
    integral = np.trapezoid(np.cos(beta) ** 2.5, beta) / (2 * math.pi)
    assert integral == pytest.approx(0.2288, abs=1e-4)  # as tabulated by Harris
    assert row.loaded((5000.0, 0.0)).load.max() == pytest.approx(5000 / (300 * integral), rel=1e-6)


def test_one_loaded_ball_carries_all():
    row = BallRow(G6016, 8, 200e-6)
    loads = row.loaded((0.0, -500.0), -math.pi / 2)
    np.testing.assert_allclose(loads.load, [500, 0, 0, 0, 0, 0, 0, 0], rtol=1e-9)
    assert loads.displacement[1] == pytest.approx(-100e-6 - (500 / row.stiffness[0]) ** (2 / 3))


def test_no_load_leaves_a_ring_with_clearance_where_it_is():
    loads = ROW.loaded(np.zeros((3, 2)))
    np.testing.assert_array_equal(loads.displacement, 0)
    np.testing.assert_array_equal(loads.load, 0)


def test_pressed_balls_are_loaded_without_a_load():
    loads = BallRow(G6016, 9, -10e-6).loaded((0.0, 0.0))
    np.testing.assert_allclose(loads.load, G6016.stiffness * 5e-6**1.5, rtol=1e-9)


def test_a_larger_ball_carries_more_and_its_neighbours_less():
    down = (0.0, -1700.0)
    nominal, larger = ROW.loaded(down, 0.3), ROW.with_oversize(5e-6, 8).loaded(down, 0.3)
    assert larger.load[7] > nominal.load[7]
    assert larger.load[6] < nominal.load[6]
    assert larger.load[8] < nominal.load[8]


def test_an_off_sized_ball_meets_the_same_grooves():
    larger = off_sized(G6016, 5e-6)
    assert larger.inner_conformity * larger.ball_diameter == pytest.approx(0.52 * 19.05e-3, rel=1e-15)
    assert larger.stiffness > G6016.stiffness
    assert off_sized(G6016, 0.0) is G6016


def test_peak_pressure_ball_by_ball():
    loads = ROW.with_oversize(5e-6, 8).loaded(np.tile([0.0, -1700.0], (4, 3, 1)), np.full((4, 3), 0.3))
    pressure = ROW.peak_pressure(loads.load)
    assert pressure.shape == (4, 3, 10)
    assert np.all((pressure > 0) == (loads.load > 0))
    np.testing.assert_array_equal(pressure[..., 0], G6016.inner.peak_pressure(loads.load[..., 0]))
    assert ROW.peak_pressure(loads.load, "outer").max() < pressure.max()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: BallRow(G6016, 2), "2 balls"),
        (lambda: BallRow(G6016, 10, 0.0, (1e-6,)), "1 ball sizes given for 10 balls"),
        (lambda: ROW.with_oversize(1e-6, 11), "balls 1 to 10"),
        (lambda: Wave(1e-6, 0), "order 0"),
        (lambda: Wave(1e-6, 2, 0.0, "middle"), "'middle'"),
        (lambda: ROW.loaded((math.nan, 0.0)), "finite"),
    ],
)
def test_what_is_no_row_of_balls_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
