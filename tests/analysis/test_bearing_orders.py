"""Orders of a rolling bearing: kinematics by velocities, and names put on lines."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from tdbsim.machine import load_machine

from tdbmon.analysis.bearing_orders import bearing_orders, name_bearing_orders
from tdbmon.analysis.lines import Line
from tdbmon.estimate import Estimate
from tdbmon.shipped import shipped


def order_line(order, name):
    frequency = Estimate.from_sigma(20.0, 0.1, "Hz", "")
    return Line("order", order, frequency, "both", "both", Estimate.from_sigma(1e-6, 1e-7, "um", ""), 1.0, 2.0, name)


@pytest.mark.parametrize("angle", [0.0, 15.0, 25.0, 40.0])
def test_orders_follow_from_rolling_without_slip(angle, machine):
    """The ball's centre moves at half the ring's surface speed; passes are counted against each race."""
    bearing, alpha = machine.bearing("NDE"), math.radians(angle)
    balls = bearing.balls.model_copy(update={"contact_angle": alpha})
    reach = balls.diameter * math.cos(alpha)  # between the contacts, across the shaft
    surface = (balls.pitch_diameter - reach) / 2  # of the ring turning once a second, over 2 pi
    cage = surface / 2 / (balls.pitch_diameter / 2)
    orders = bearing_orders(bearing.model_copy(update={"balls": balls}))
    assert orders["cage"] == pytest.approx(cage)
    assert orders["ball pass outer"] == pytest.approx(balls.count * cage)
    assert orders["ball pass inner"] == pytest.approx(balls.count * (1 - cage))
    # on the outer race, at rest, the ball rolls backward as the cage goes forward; against the cage it turns so often,
    # on a circle that its axis, steeper than the contact, makes smaller
    axis = math.atan2(math.sin(alpha), math.cos(alpha) + balls.diameter / balls.pitch_diameter)
    circle = balls.diameter * math.cos(alpha - axis)
    assert orders["ball spin"] == pytest.approx(cage * (balls.pitch_diameter + reach) / circle)


def test_orders_of_a_shipped_pair_at_25_degrees():
    """Closed forms (Harris) with 23 balls of 9.525 mm on 85 mm, worked by hand."""
    orders = bearing_orders(load_machine(shipped("machines/generator_71914.toml")).touchdown_bearings[0])
    assert orders["cage"] == pytest.approx(0.44922, abs=5e-6)
    assert orders["ball pass outer"] == pytest.approx(10.3321, abs=1e-4)
    assert orders["ball pass inner"] == pytest.approx(12.6679, abs=1e-4)


def test_a_line_of_a_cage_at_an_angle_is_named():
    """Without the contact angle the cage's order was 1.2 % lower, and its line stayed without a name."""
    machine = load_machine(shipped("machines/generator_71914.toml"))
    named = name_bearing_orders([order_line(order, "") for order in (0.4492, 0.4440)], machine)
    assert [line.name for line in named] == [" cage", ""]


def test_only_lines_of_the_bearing_get_its_names(machine):
    line = order_line(4.747, "4.75X")
    named = name_bearing_orders(
        (line, replace(line, order=5.0, name="5X"), replace(line, kind="constant", order=None)), machine
    )
    assert [n.name for n in named] == ["4.75X ball pass outer", "5X", "4.75X"]
