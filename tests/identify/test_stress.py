"""Stress of the balls: of what the machine file tells, and what it assumes where that does not."""

import numpy as np
import pytest
from tdbsim.machine import Balls

from tdbmon.identify.stress import assumed, ball_stress


def with_balls(bearing, **told):
    stated = {name: getattr(bearing.balls, name) for name in bearing.balls.model_fields_set} | told
    stated["stiffness"] = stated.pop("stated_stiffness")
    return bearing.model_copy(update={"balls": Balls.model_validate(stated)})


def test_what_the_file_does_not_tell_is_said(machine):
    bearing = machine.bearing("NDE")
    assert assumed(bearing) == (
        "assumes inner groove conformity 0.52, outer groove conformity 0.52, steel balls, not stated in the machine file"
    )
    told = with_balls(bearing, inner_conformity=0.52, outer_conformity=0.53)
    assert assumed(told) == "assumes steel balls, not stated in the machine file"
    assert assumed(with_balls(told, material="steel")) == ""


def test_stress_goes_by_material_and_groove(machine):
    """Peak pressure goes with E'^(2/3): E' of ceramic on steel is 1.18 times that of steel on steel."""
    bearing, load = machine.bearing("NDE"), np.array([0.0, 500.0, 2000.0])
    steel = ball_stress(bearing, load)
    hybrid = ball_stress(with_balls(bearing, material="silicon nitride"), load)
    plane = (1 - 0.3**2) / 210e9, (1 - 0.26**2) / 310e9
    assert hybrid[1:] / steel[1:] == pytest.approx((2 * plane[0] / sum(plane)) ** (2 / 3), rel=1e-9)
    assert steel[2] / steel[1] == pytest.approx(4 ** (1 / 3))
    assert np.all(ball_stress(with_balls(bearing, inner_conformity=0.56), load)[1:] > steel[1:])
