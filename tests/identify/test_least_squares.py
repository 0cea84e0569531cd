"""Searches by slopes to one side and to both; a synthetic drop by the model's own simulator."""

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import fit, linearised
from tdbmon.identify.problem import build_problem
from tdbmon.shipped import shipped
from tests.identify import drops

TRUTH = drops.TRUTH | {"NDE.diametral_clearance": 19.6e-6, "DE.diametral_clearance": 16.4e-6}


@pytest.fixture(scope="module")
def problem():
    machine = load_machine(shipped("short/machine.toml"))
    with Crew() as crew:
        yield build_problem(machine, (measured_drop(drops.drop(TRUTH, seconds=0.03), machine),), crew)


def test_curvature_falls_out_of_the_mean_of_both_sides(problem):
    """In the fall the path is a parabola of the release: one side is off in proportion to the step, both to its square."""
    at = len(problem.shared) + [p.name for p in problem.own[0]].index("release")

    def column(share, sides):
        own = tuple(replace(p, nudge=share * p.nudge) if p.name == "release" else p for p in problem.own[0])
        return linearised(replace(problem, own=(own,)), problem.start, 0.006, sides).slopes[0][:, at]

    exact, steps = column(1.0, (1, -1)), (10.0, 20.0)
    one = [np.linalg.norm(column(step, (1,)) - exact) for step in steps]
    both = [np.linalg.norm(column(step, (1, -1)) - exact) for step in steps]
    assert one[1] == pytest.approx(2 * one[0], rel=0.05)
    assert both[1] == pytest.approx(4 * both[0], rel=0.05)
    assert both[1] < 0.1 * one[1]


def test_a_search_to_the_bottom_goes_on_where_one_side_no_longer_gains(problem):
    """Past the first contacts, where paths bend: in this drop the misfits part at 18 ms."""
    machine = drops.machine()
    drop = drops.guessed_early(measured_drop(drops.drop(speed=148.0, seed=2), machine), 10e-6)
    usual = build_problem(machine, (drop,), problem.crew)
    thorough = replace(usual, to_the_bottom=True)
    one = both = usual.start
    for horizon in (0.006, 0.014, 0.018):
        shallow, deep = fit(usual, one, horizon), fit(thorough, both, horizon)
        one, both = shallow.point, deep.point
        assert deep.misfit < shallow.misfit + 10
    assert deep.misfit < shallow.misfit - 50
