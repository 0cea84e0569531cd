"""A magnetic force that fades: the fall of both laws against its closed form."""

import math

import numpy as np
import pytest
from changed_machine import changed
from tdbsim.errors import InputError
from tdbsim.simulate import DropPlan, simulate
from tdbsim.stated_effects import parse

DECAY = 4e-3


def exponential(since, g):
    return g * (since**2 / 2 - DECAY * since + DECAY**2 * -np.expm1(-since / DECAY))


def linear(since, g):
    fading = g * np.minimum(since, DECAY) ** 3 / (6 * DECAY)
    beyond = np.maximum(since - DECAY, 0.0)
    return fading + g * DECAY / 2 * beyond + g * beyond**2 / 2


@pytest.mark.parametrize("law", [exponential, linear])
def test_a_shaft_falls_by_what_the_magnets_let_go(machine, law):
    """Turning slowly and without unbalance; rigid but for the bending that the magnets' forces held, hence the micrometre."""
    machine = changed(machine, rotor={"unbalance": ()})
    plan = DropPlan(speed=1.0, seconds=8e-3)
    fade = parse(f"residual_magnetic_force:decay_time={DECAY} s,law={law.__name__}")
    drop = simulate(machine, plan, [fade])
    since = drop["time"].values - drop.attrs["release_time_s"]
    fallen = drop["rotor_y"].values[:, since >= 0]
    weight = np.array([0.5, 0.5])  # of a fall without turning about the middle
    expected = law(since[since >= 0], machine.gravity)
    assert expected[-1] > 100e-6
    np.testing.assert_allclose(weight @ (fallen[:, :1] - fallen), expected, atol=1e-6)


def test_a_law_that_is_none_is_refused():
    with pytest.raises(InputError, match="law 'linaer' is not one of exponential, linear"):
        parse("residual_magnetic_force:decay_time=4 ms,law=linaer")


def test_the_linear_law_ends():
    from tdbsim.effects.residual_magnetic_force import holding

    assert holding(DECAY / 4, (DECAY, 1.0), 0) == pytest.approx(0.75)
    assert holding(2 * DECAY, (DECAY, 1.0), 0) == 0.0
    assert holding(DECAY, (DECAY, 0.0), 0) == pytest.approx(1 / math.e)
