"""A drop that lost its way is found among those that fit, and led back; synthetic drops by the model's own simulator."""

from dataclasses import replace

import numpy as np
import pytest

from tdbmon.diagnosis.contender import Contender, with_cause
from tdbmon.diagnosis.suspects import Start, suspects
from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import Fit, fit, linearised
from tdbmon.identify.problem import build_problem
from tdbmon.identify.stray import led_back, stray_drop
from tests.diagnosis.simulated import record
from tests.identify import drops

HORIZON = 0.022  # s
SOUND = 1.1  # misfit a residual
BALL = "off_sized_ball:end=DE,deviation=20 um,ball=1"


def left(*squares):
    """A fit that leaves so much a residual of each drop."""
    residuals = tuple(np.full(50, square**0.5) for square in squares)
    return Fit(np.zeros(0), residuals, (), float(sum(squares)))


@pytest.mark.parametrize(
    ("squares", "stray"),
    [
        ((0.9, 0.9, 1.2, 0.9), 2),
        ((0.9, 0.9, 1.05, 0.9), None),  # it leaves noise alone too
        ((1.4, 1.4, 1.9, 1.4), None),  # the model is wrong
        ((0.9, 1.2, 1.3, 0.9), None),  # two of them: then the values that all share are wrong
        ((1.2,), None),
    ],
)
def test_the_one_drop_that_leaves_more_than_noise_strayed(squares, stray):
    assert stray_drop(left(*squares), SOUND) == stray


@pytest.fixture(scope="module")
def found():
    """Three drops with a ball that differs, fitted from its true size and number."""
    machine = drops.machine()
    with Crew() as crew:
        records = [record(machine, speed, seed, BALL) for speed, seed in ((80.0, 1), (110.0, 3), (150.0, 2))]
        problem = build_problem(machine, tuple(measured_drop(each, machine) for each in records), crew)
        fallen = Contender((), problem, fit(problem, problem.start, 0.006, 3), 0.006, 0.9)
        ball = next(s for s in suspects(machine, machine.probes, ()) if s.name == "off_sized_ball@DE")
        begun = with_cause(fallen, ball, Start({"deviation": 20e-6}, (), ({"ball": 1.0},) * 3))
        point = begun.fit.point
        for horizon in (0.01, 0.014, 0.018, HORIZON):
            point = fit(begun.problem, point, horizon, 3).point
        yield replace(begun, fit=fit(begun.problem, point, HORIZON))


def test_a_drop_whose_ball_is_across_the_bearing_is_led_back(found):
    problem = found.problem
    right = found.fit
    assert stray_drop(right, SOUND) is None
    cage = len(problem.shared) + [p.name for p in problem.own[1]].index("cage_1")
    at = problem.columns(1)[cage]
    across = right.point.copy()
    across[at] += np.pi / problem.parameters[at].scale
    strayed = fit(problem, across, HORIZON, 2)
    assert stray_drop(strayed, SOUND) == 1
    led = led_back(problem, strayed, 1, HORIZON)
    assert stray_drop(led, SOUND) is None
    assert led.misfit < right.misfit + 0.1 * (strayed.misfit - right.misfit)


def test_a_drop_that_is_right_stays(found):
    there = linearised(found.problem, found.fit.point, HORIZON)
    led = led_back(found.problem, there, 2, HORIZON)
    assert led.misfit <= there.misfit
