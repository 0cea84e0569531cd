"""Places in the state: each has one name, in Python as in compiled kernels, and the names mean what they say."""

import numpy as np
import pytest
from tdbsim import state_layout
from tdbsim.cache import called
from tdbsim.drop_model import build_model
from tdbsim.simulate import DropPlan, initial_state, run


@pytest.mark.parametrize("n", [2, 6, 16])
def test_every_place_has_one_name(n):
    places = np.arange(state_layout.size(n))
    modes = [places[each(n)] for each in (state_layout.modes_x, state_layout.modes_y)]
    bodies = [state_layout.bodies(n, end) + np.arange(6) for end in range(2)]
    positions = np.concatenate([*modes, *bodies, [state_layout.shaft_angle(n)], places[state_layout.ring_angles(n)]])
    np.testing.assert_array_equal(positions, np.arange(state_layout.positions(n)))

    modes = [places[each(n)] for each in (state_layout.mode_rates_x, state_layout.mode_rates_y)]
    bodies = [each + state_layout.positions(n) for each in bodies]
    rates = np.concatenate([*modes, *bodies, [state_layout.omega(n)], places[state_layout.ring_speeds(n)]])
    np.testing.assert_array_equal(rates, positions + state_layout.positions(n))

    work = state_layout.work(n) + np.arange(len(state_layout.LEDGER))
    np.testing.assert_array_equal(np.concatenate([positions, rates, work]), places)
    for end in range(2):
        assert state_layout.ring_angle(n, end) == places[state_layout.ring_angles(n)][end]
        assert state_layout.ring_speed(n, end) == places[state_layout.ring_speeds(n)][end]


@called
def compiled_places(n, end):
    return (
        state_layout.positions(n), state_layout.bodies(n, end), state_layout.shaft_angle(n),
        state_layout.ring_angle(n, end), state_layout.omega(n), state_layout.ring_speed(n, end), state_layout.work(n),
        state_layout.size(n),
    )  # fmt: skip


@pytest.mark.parametrize("end", [0, 1])
def test_compiled_kernels_have_the_same_places(end):
    assert compiled_places(6, end) == compiled_places.py_func(6, end)


def test_a_drop_begins_as_planned_and_its_positions_follow_their_rates(machine):
    plan = DropPlan(150.0, 1e-4, sampling=1e6, shaft_angle=0.4, ring_angle=(0.1, 0.2), set_point=((2e-5, 1e-5),) * 2)
    model = build_model(machine)
    n, start = model.n, initial_state(model, plan)
    assert start[state_layout.shaft_angle(n)] == 0.4
    np.testing.assert_array_equal(start[state_layout.ring_angles(n)], plan.ring_angle)
    assert start[state_layout.omega(n)] == pytest.approx(machine.sense * 2 * np.pi * 150.0)
    state = run(model, plan).state
    for place in (0, n, state_layout.bodies(n, 1) + 1, state_layout.shaft_angle(n)):
        rate = state[:, state_layout.positions(n) + place]
        moved = np.trapezoid(rate, dx=1e-6)
        assert state[-1, place] - state[0, place] == pytest.approx(moved, rel=1e-4, abs=1e-12)
