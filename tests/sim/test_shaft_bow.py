"""A bent shaft: its shape, and what a slow one shows between bearings that leave it bent."""

import numpy as np
import pytest
from changed_machine import changed
from tdbsim.drop_model import build_model
from tdbsim.errors import InputError
from tdbsim.signature import before_release
from tdbsim.simulate import DropPlan, simulate
from tdbsim.stated_effects import parse

BOW, PHASE = 40e-6, np.radians(30)
SHAPES = ("even", "bending_mode")


def bent(shape):
    return parse(f"shaft_bow:bow=40 um,phase=30 deg,shape={shape}")


def from_line(model, positions, ends):
    """Return how far the unstressed shaft lies from the line through two positions, complex, in its own frame."""
    modal = model.arrays.bow[0] + 1j * model.arrays.bow[1]
    first, second = model.modes.at(ends) @ modal
    share = (positions - ends[0]) / (ends[1] - ends[0])
    return model.modes.at(positions) @ modal - (first + share * (second - first))


def bearings(machine):
    return np.sort([bearing.position for bearing in machine.touchdown_bearings])


@pytest.mark.parametrize("shape", SHAPES)
def test_greatest_distance_from_the_line_through_the_bearings_is_the_bow(machine, shape):
    model = build_model(machine, [bent(shape)], bending=8)
    between = np.linspace(*bearings(machine), 101)
    distance = from_line(model, between, bearings(machine)) * np.exp(-1j * PHASE)
    assert np.abs(distance.imag).max() < 1e-9 * BOW
    assert distance.real.max() == pytest.approx(BOW, rel=5e-3)  # with eight of the modes
    assert distance.real.min() > -1e-9


def test_a_bow_of_the_bending_mode_is_of_that_mode_alone(machine):
    model = build_model(machine, [bent("bending_mode")])
    modal = np.hypot(*model.arrays.bow)
    first = model.modes.names.index("bending 1")
    assert modal[first] > 0
    assert np.delete(modal, first).max() < 1e-9 * modal[first]


def test_the_shapes_differ_beyond_the_bearings(machine):
    """So that a bow of one is not told by the other: by a good part of it at the end of the shaft."""
    overhang = np.array([machine.rotor.length])
    even, mode = (
        from_line(build_model(machine, [bent(shape)], bending=8), overhang, bearings(machine)) for shape in SHAPES
    )
    assert abs(even - mode)[0] > 0.1 * BOW


@pytest.mark.parametrize("shape", SHAPES)
def test_a_slow_shaft_runs_round_as_it_is_bent(machine, shape):
    """No force bends it back: the magnets hold it where it does not move, the probes see how far it is from the line there."""
    machine = changed(machine, rotor={"unbalance": ()})
    plan = DropPlan(speed=1.0, seconds=0.001, levitated=1.0, sampling=2e3)
    held = before_release(simulate(machine, plan, [bent(shape)]))
    magnets = np.array([magnet.position for magnet in machine.magnetic_bearings])
    probes = np.array([probe.position for probe in machine.probes])
    away = np.abs(from_line(build_model(machine, [bent(shape)]), probes, magnets))
    assert away.min() > 0.02 * BOW
    for seen in (held["shaft_x"], held["shaft_y"]):
        np.testing.assert_allclose(np.ptp(seen.values, axis=1) / 2, away, rtol=0.01)


def test_a_bow_of_the_bending_mode_needs_that_mode(machine):
    with pytest.raises(InputError, match="shape bending_mode needs a model with a bending mode"):
        build_model(machine, [bent("bending_mode")], bending=0)
