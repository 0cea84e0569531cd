"""Natural frequencies of the resting rotor: rigid bodies on springs in closed form, pendulums, limits, another code path."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from tdbsim.machine import load_machine
from tdbsim.modes import Spring, whirl_modes
from tdbsim.rotor import build_rotor

from tdbmon.analysis.rest import ball_travel, rest_travel
from tdbmon.analysis.resting_modes import RestingEnd, ball_stiffness, resting_basis, resting_ends, resting_modes
from tdbmon.shipped import shipped

STIFF = 1e13  # N/m, against which everything else gives way


@pytest.fixture(scope="module")
def machine():
    return load_machine(shipped("coastdown/machine.toml"))


@pytest.fixture(scope="module")
def rotor(machine):
    return build_rotor(machine)


@pytest.fixture(scope="module")
def basis(machine, rotor):
    return resting_basis(machine, rotor)


def on_springs(machine, stiffness, **more):
    """Ends on plain springs of one stiffness an end in both directions."""
    return tuple(
        RestingEnd(
            **{
                "end": bearing.name, "position": bearing.position, "load": 1.0, "contact": STIFF, "balls": STIFF,
                "support": k, "ring_mass": 0.0, "support_mass": 0.0, "pendulum": k, "rolling_mass": 0.0, **more,
            }
        )
        for bearing, k in zip(machine.touchdown_bearings, stiffness, strict=True)
    )  # fmt: skip


@pytest.mark.parametrize("speed", [0.0, 95.0, 300.0])
def test_on_plain_springs_they_are_the_whirl_modes(speed, machine, rotor, basis):
    """`tdbsim.modes` solves the same rotor on round springs in complex coordinates, in a larger basis."""
    stiffness = (4.8e7, 6.9e7)
    found = resting_modes(basis, on_springs(machine, stiffness), speed, 8).frequencies[0]
    springs = [Spring(b.position, k, k) for b, k in zip(machine.touchdown_bearings, stiffness, strict=True)]
    undamped = replace(rotor, modal_damping_ratio=0.0)
    assert found == pytest.approx(whirl_modes(undamped, springs, speed, 8).frequencies, rel=1e-4)


@pytest.mark.parametrize("speed", [0.0, 40.0])
def test_rigid_rotor_on_soft_springs_in_closed_form(speed, machine, rotor, basis):
    """Springs with equal moments about the centre of mass: translation, and the conical whirl Id s^2 - Ip w s = k_t."""
    arms = [bearing.position - rotor.centre_of_mass for bearing in machine.touchdown_bearings]
    k = (2e4 / abs(arms[0]), 2e4 / abs(arms[1]))
    found = resting_modes(basis, on_springs(machine, k), speed, 4).frequencies[0]
    tilt = sum(ki * a**2 for ki, a in zip(k, arms, strict=True))
    turn = rotor.polar_inertia * 2 * np.pi * speed / (2 * rotor.diametral_inertia)
    root = np.sqrt(turn**2 + tilt / rotor.diametral_inertia)
    expected = [np.sqrt(sum(k) / rotor.total_mass)] * 2 + [root - turn, root + turn]
    assert found == pytest.approx(np.sort(expected) / (2 * np.pi), rel=1e-3)


def test_support_mass_under_a_rigid_rotor_is_two_masses_on_springs(machine, rotor, basis):
    """Mass-matrix in the coordinates of the two ends and their supports, written down without modes."""
    ends = tuple(
        replace(e, contact=3e5, balls=1.5e5, support=k, ring_mass=0.4, support_mass=30.0, pendulum=STIFF)
        for e, k in zip(on_springs(machine, (1e5, 1e5)), (2e5, 4e5), strict=True)
    )
    arms = np.array([bearing.position - rotor.centre_of_mass for bearing in machine.touchdown_bearings])
    turn = np.linalg.inv(np.column_stack([np.ones(2), arms]))
    mass = np.zeros((6, 6))
    mass[:2, :2] = turn.T @ np.diag([rotor.total_mass, rotor.diametral_inertia]) @ turn
    mass[2:, 2:] = np.diag([0.4, 30.0, 0.4, 30.0])
    stiffness = np.zeros((6, 6))
    for i, end in enumerate(ends):
        for a, b, k in ((i, 2 + 2 * i, end.contact), (2 + 2 * i, 3 + 2 * i, end.balls)):
            stiffness[np.ix_([a, b], [a, b])] += k * np.array([[1, -1], [-1, 1]])
        stiffness[3 + 2 * i, 3 + 2 * i] += end.support
    expected = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    found = resting_modes(basis, ends, n=12)
    upwards = found.frequencies[0][found.sideways[0] < 0.5]
    assert upwards[:4] == pytest.approx(expected[:4], rel=1e-3)


def test_a_massless_support_is_its_springs_in_series(machine, rotor, basis):
    ends = tuple(replace(end, ring_mass=0.0, support_mass=0.0) for end in resting_ends(machine, rotor))
    plain = tuple(replace(end, contact=STIFF, balls=STIFF, support=end.series) for end in ends)
    nearly = tuple(replace(end, ring_mass=1e-6, support_mass=1e-6) for end in ends)
    found = resting_modes(basis, ends).frequencies
    assert found == pytest.approx(resting_modes(basis, plain).frequencies, rel=1e-4)
    assert found == pytest.approx(resting_modes(basis, nearly).frequencies, rel=1e-6)


def test_an_immovable_support_leaves_balls_and_contact(machine, rotor, basis):
    heavy = tuple(replace(end, ring_mass=0.0, support_mass=1e9) for end in resting_ends(machine, rotor))
    fixed = tuple(replace(end, ring_mass=0.0, support_mass=0.0, support=STIFF) for end in heavy)
    found, expected = resting_modes(basis, heavy, n=8), resting_modes(basis, fixed, n=6)
    assert found.frequencies[0][2:] == pytest.approx(expected.frequencies[0], rel=1e-4)  # two of the masses themselves
    assert np.all(found.frequencies[0][:2] < 0.2)


def test_sideways_it_swings_as_a_pendulum(machine, rotor, basis):
    """Both ends with one radius: the parallel swing is that of a point mass, sqrt(g / R).

    The radius is a wide one: in a usual clearance the swing is fast enough to bend the shaft by half a percent.
    """
    radius = 0.03
    ends = tuple(replace(end, pendulum=end.load / radius, rolling_mass=0.0) for end in resting_ends(machine, rotor))
    found = resting_modes(basis, ends)
    assert found.sideways[0, 0] > 0.999
    assert found.frequencies[0, 0] == pytest.approx(np.sqrt(machine.gravity / radius) / (2 * np.pi), rel=1e-3)


def test_speed_changes_little_by_little_and_its_sense_nothing(machine, rotor, basis):
    ends = resting_ends(machine, rotor)
    still, slow = resting_modes(basis, ends, (0.0, 0.01)).frequencies
    assert slow == pytest.approx(still, rel=1e-6)
    forth, back = resting_modes(basis, ends, (120.0, -120.0)).frequencies
    assert forth == pytest.approx(back, rel=1e-9)
    assert np.abs(forth / still - 1).max() > 1e-3  # the gyroscopic moment does act


def test_stiffness_about_the_load_is_that_of_the_travel(machine, rotor):
    """The sum of the parts' compliances is the slope of the whole travel over load."""
    for end in resting_ends(machine, rotor):
        bearing = machine.bearing(end.end)
        step = 1e-3 * end.load
        clearance = bearing.balls.diametral_clearance.nominal
        weight = machine.gravity * bearing.inner_ring_mass
        sag = [
            rest_travel(bearing, load).contact + ball_travel(bearing, load + weight, clearance) + load / end.support
            for load in (end.load - step, end.load + step)
        ]
        assert end.series == pytest.approx(2 * step / (sag[1] - sag[0]), rel=2e-3)
        assert end.pendulum == pytest.approx(
            end.load / (bearing.radial_gap.nominal + rest_travel(bearing, end.load).total)
        )
        assert ball_stiffness(bearing, 4 * end.load) > 1.2 * ball_stiffness(bearing, end.load)  # balls stiffen
