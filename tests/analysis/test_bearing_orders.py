"""Orders of a rolling bearing: kinematics by velocities, and names put on lines."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tdbmon.analysis.bearing_orders import bearing_orders, name_bearing_orders
from tdbmon.analysis.lines import Line
from tdbmon.estimate import Estimate


def test_orders_follow_from_rolling_without_slip(machine):
    """The ball's centre moves at half the ring's surface speed; passes are counted against each race."""
    bearing = machine.bearing("NDE")
    balls = bearing.balls
    surface = (balls.pitch_diameter - balls.diameter) / 2  # of the ring turning once a second, over 2 pi
    cage = surface / 2 / (balls.pitch_diameter / 2)
    orders = bearing_orders(bearing)
    assert orders["cage"] == pytest.approx(cage)
    assert orders["ball pass outer"] == pytest.approx(balls.count * cage)
    assert orders["ball pass inner"] == pytest.approx(balls.count * (1 - cage))
    # on the outer race, at rest, the ball rolls backward as the cage goes forward; against the cage it turns so often
    assert orders["ball spin"] == pytest.approx(cage * (balls.pitch_diameter + balls.diameter) / balls.diameter)


def test_only_lines_of_the_bearing_get_its_names(machine):
    frequency = Estimate.from_sigma(20.0, 0.1, "Hz", "")
    line = Line("order", 4.747, frequency, "both", "both", Estimate.from_sigma(1e-6, 1e-7, "um", ""), 1.0, 2.0, "4.75X")
    named = name_bearing_orders(
        (line, replace(line, order=5.0, name="5X"), replace(line, kind="constant", order=None)), machine
    )
    assert [n.name for n in named] == ["4.75X ball pass outer", "5X", "4.75X"]
