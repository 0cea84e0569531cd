"""What the rest radius is made of: the balls carry the load, and the limits are closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tdbmon.analysis.rest import ball_travel, rest_travel


@settings(max_examples=30, deadline=None)
@given(st.floats(1, 20000), st.floats(-3e-5, 5e-5))
@example(20.0, -5e-6)
@example(200.0, -2e-5)
def test_balls_at_the_travel_found_carry_the_load_on_average(machine, load, clearance):
    """Check the travel against equilibrium at every cage angle (independent search by scipy)."""
    from scipy.optimize import brentq

    bearing = machine.bearing("NDE")
    balls = bearing.balls

    def carried(travel, cage):
        c = np.cos(cage + 2 * np.pi * np.arange(balls.count) / balls.count)
        return np.sum(bearing.ball_stiffness * np.maximum(travel * c - clearance / 2, 0) ** 1.5 * c) - load

    cages = np.linspace(0, 2 * np.pi / balls.count, 16, endpoint=False)
    travels = [brentq(carried, 0, 1e-3, args=(cage,), xtol=1e-16) for cage in cages]
    assert ball_travel(bearing, load, clearance) == pytest.approx(np.mean(travels), rel=1e-6)


def test_without_load_half_the_clearance_is_left(machine):
    assert ball_travel(machine.bearing("NDE"), 1e-9, 20e-6) == pytest.approx(10e-6, rel=0.03)


def test_without_load_preloaded_balls_hold_the_ring_in_the_centre(machine):
    assert ball_travel(machine.bearing("NDE"), 0.0, -20e-6) == pytest.approx(0.0, abs=1e-15)


def test_without_clearance_the_load_follows_the_three_halves_power(machine):
    bearing = machine.bearing("NDE")
    assert ball_travel(bearing, 8000, 0) / ball_travel(bearing, 1000, 0) == pytest.approx(8 ** (2 / 3), rel=1e-6)


def test_parts_add_up_and_stiffen(machine):
    travel = rest_travel(machine.bearing("DE"), 600.0)
    assert travel.total == pytest.approx(travel.contact + travel.balls + travel.support)
    assert travel.support == pytest.approx(600.0 / 4.03e8)
    # the derivative over the load, by another step
    more, less = (rest_travel(machine.bearing("DE"), 600.0 * f).total for f in (1.001, 0.999))
    assert travel.per_load == pytest.approx((more - less) / 0.002, rel=0.02)
