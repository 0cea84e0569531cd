"""Bearings as a catalogue tells them: stiffness and loads follow, against the exact bearing and in a run."""

import math
import tomllib

import numpy as np
import pytest
from tdbsim import angular_contact
from tdbsim.ball_load import BallRow
from tdbsim.columns import CAGE_RATIO
from tdbsim.drop_model import build_model
from tdbsim.drop_record import drop_record
from tdbsim.errors import InputError
from tdbsim.hertz import BEARING_STEEL, SILICON_NITRIDE, BearingGeometry
from tdbsim.machine import Balls, Machine, parse_machine
from tdbsim.simulate import DropPlan, run, simulate

from tdbmon.shipped import shipped

CATALOGUE = {"count": 23, "diameter": "9.525 mm", "pitch_diameter": "85 mm", "diametral_clearance": "0 um"}
PAIR = CATALOGUE | {"rows": 2, "contact_angle": "25 deg", "material": "silicon nitride"}


def on(machine: Machine, **balls: object) -> Machine:
    """Return the machine with other balls in both bearings."""
    parts = tuple(each.model_copy(update={"balls": Balls.model_validate(balls)}) for each in machine.touchdown_bearings)
    return machine.model_copy(update={"touchdown_bearings": parts})


def test_stiffness_follows_from_the_catalogue(machine):
    deep = on(machine, **CATALOGUE, outer_conformity=0.53).bearing("NDE")
    assert deep.ball_stiffness == BearingGeometry(9.525e-3, 85e-3, 0.52, 0.53).stiffness
    hybrid = on(machine, **CATALOGUE, material="silicon nitride").bearing("NDE")
    assert hybrid.geometry.ball == SILICON_NITRIDE
    assert hybrid.geometry.race == BEARING_STEEL
    assert hybrid.ball_stiffness > 1.1 * on(machine, **CATALOGUE).bearing("NDE").ball_stiffness
    stated = on(machine, **CATALOGUE, stiffness=1.5e10).bearing("NDE")
    assert stated.ball_stiffness == 1.5e10


@pytest.mark.parametrize("press", [1e-6, 5e-6, 20e-6])
@pytest.mark.parametrize("arrangement", ["X", "O"])
def test_rows_share_the_radial_load_as_the_pair_itself_does(machine, press, arrangement):
    """The pair lets its contact angle fall under load, a run does not: 1.5 % of the force at 20 um, 9.1 kN."""
    bearing = on(machine, **PAIR).bearing("NDE")
    exact = angular_contact.pair(bearing.geometry, 23, 16e-3, arrangement)
    where = [0.0, -press, 0.0, 0.0, 0.0]
    azimuth = -math.pi / 2 + 2 * math.pi * np.arange(23) / 23
    radial = bearing.ball_stiffness * np.maximum(-press * np.sin(azimuth), 0.0) ** 1.5
    assert -np.sum(radial * np.sin(azimuth)) == pytest.approx(-exact.force(where, -math.pi / 2)[1], rel=0.015)
    loads = exact.displaced(where, -math.pi / 2)
    for row in loads:
        np.testing.assert_allclose(radial * bearing.balls.radial_share, row.load, rtol=0.03, atol=1e-9)


def test_a_drop_records_the_load_of_one_ball(machine):
    """Two rows at an angle: the balls' loads, put together, move the ring as one row of the joint stiffness does."""
    paired = on(machine, **PAIR)
    stiffness = paired.bearing("NDE").ball_stiffness
    plan = DropPlan(speed=100.0, seconds=0.02)
    one_row = build_model(on(machine, **CATALOGUE, stiffness=stiffness))
    one_row.arrays.end[:, CAGE_RATIO] = build_model(paired).arrays.end[:, CAGE_RATIO]  # the angle's other work
    joint = drop_record(run(one_row, plan))
    rows = simulate(paired, plan)
    np.testing.assert_array_equal(rows["normal_force"], joint["normal_force"])
    loads = joint["ball_load"].values
    assert loads.max() > 500.0
    np.testing.assert_allclose(rows["ball_load"].values, loads / (2 * math.cos(math.radians(25))), rtol=1e-12)


def test_catalogue_and_row_at_rest_agree(machine):
    bearing = on(machine, **CATALOGUE).bearing("NDE")
    loads = BallRow(bearing.geometry, 23).loaded((0.0, -1000.0))
    press = np.max(loads.press)
    assert bearing.ball_stiffness * press**1.5 == pytest.approx(np.max(loads.load), rel=1e-12)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"inner_conformity": 0.5}, "inner_conformity"),
        ({"contact_angle": "75 deg"}, "contact_angle"),
        ({"rows": 0}, "rows"),
        ({"material": "ceramic"}, "material"),
        ({"stiffness": -1.0}, "stiffness"),
        ({"count": 40}, "40 balls of 9.525 mm do not fit"),
    ],
)
def test_a_bearing_that_cannot_be_is_refused(wrong, says):
    data = tomllib.loads(shipped("coastdown/machine.toml").read_text())
    data["touchdown_bearing"][0]["balls"] = CATALOGUE | wrong
    with pytest.raises(InputError, match=says):
        parse_machine(data, "machine.toml")
