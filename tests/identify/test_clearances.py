"""Fits begun at other clearances of the balls, where a descent along the valley of gap and clearance has ended early."""

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.identify.cages import circle, turning
from tdbmon.identify.clearances import beside, better_clearances, hardly_gained, led_along
from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import Fit, fit, linearised
from tdbmon.identify.problem import build_problem
from tdbmon.shipped import shipped
from tests.identify import drops

TRUTH = drops.TRUTH | {"NDE.diametral_clearance": 19.6e-6, "DE.diametral_clearance": 16.4e-6}
FALL_S, TOUCHED_S, LATE_S = 0.006, 0.014, 0.027


@pytest.fixture(scope="module")
def problem():
    """One drop of a machine whose clearances are known to 30 %."""
    machine = load_machine(shipped("short/machine.toml"))
    with Crew() as crew:
        yield build_problem(machine, (measured_drop(drops.drop(TRUTH, seconds=0.03), machine),), crew)


def true_start(problem):
    """The true shared values, and nominal ones of each drop."""
    names, start = [p.name for p in problem.shared], problem.start
    for name, value in TRUTH.items():
        parameter = problem.shared[names.index(name)]
        start[names.index(name)] = (value - parameter.nominal) / parameter.scale
    return start


def test_a_fit_that_ended_in_the_valley_is_led_on_to_its_bottom(problem):
    drop = drops.guessed_early(problem.drops[0], 15e-6)
    problem = build_problem(problem.model.machine, (drop,), problem.crew)
    names = [p.name for p in problem.shared]
    told = fit(problem, fit(problem, true_start(problem), FALL_S).point, TOUCHED_S)
    astray = fit(problem, problem.start, FALL_S).point
    for end in problem.model.machine.ends:
        gap, clearance = names.index(f"{end}.radial_gap"), names.index(f"{end}.diametral_clearance")
        wider = (1.8 - astray[clearance]) * problem.shared[clearance].scale
        astray[clearance] = 1.8
        astray[gap] -= wider / 2 / problem.shared[gap].scale
    early = fit(problem, astray, TOUCHED_S, 3)
    assert early.misfit > told.misfit + 100
    led = better_clearances(problem, early, TOUCHED_S)
    assert led.misfit - told.misfit < 0.1 * (early.misfit - told.misfit)  # both end a little short of the bottom


def test_fits_beside_find_the_valley_that_the_hollow_hides(problem):
    """One drop's first contacts hardly tell the clearances: points far off along the valley leave no more than the fit."""
    names = [p.name for p in problem.shared]
    found = fit(problem, fit(problem, problem.start, FALL_S).point, TOUCHED_S, 3)
    near = beside(problem, found, TOUCHED_S)
    assert len(near) == 4
    for end in problem.model.machine.ends:
        gap, clearance = names.index(f"{end}.radial_gap"), names.index(f"{end}.diametral_clearance")
        away = max(near, key=lambda each: abs(each.point[clearance] - found.point[clearance]))
        wider = (away.point - found.point)[[gap, clearance]] * [problem.shared[k].scale for k in (gap, clearance)]
        assert abs(wider[1]) > 1e-6
        assert wider[0] == pytest.approx(-wider[1] / 2, abs=0.2 * abs(wider[1]))
        assert away.misfit < found.misfit + 50


def test_a_fit_with_clearance_and_cages_wrong_is_led_back():
    """Another clearance with each drop's cage half a ball's spacing off: neither is left without the other."""
    machine = load_machine(shipped("short/machine.toml"))
    # of drops by other seeds the fit leaves these values by itself, or ends beside them, as rounding has it
    records = [drops.drop(TRUTH, speed=60.0 + 40 * k, seed=34 + k, seconds=0.03) for k in range(2)]
    with Crew() as crew:
        problem = build_problem(machine, tuple(measured_drop(each, machine) for each in records), crew)
        names = [p.name for p in problem.shared]
        wrong = true_start(problem)
        for horizon in (FALL_S, TOUCHED_S, 0.018, LATE_S):
            told = fit(problem, wrong, horizon)
            wrong = told.point.copy()
        gap, clearance = names.index("NDE.radial_gap"), names.index("NDE.diametral_clearance")
        wrong[clearance] -= 1.0
        wrong[gap] += problem.shared[clearance].scale / 2 / problem.shared[gap].scale
        for drop in range(2):
            cage = problem.columns(drop)[len(names) + turning(problem)[0]]
            wrong[cage] += circle(problem, problem.parameters[cage])[1] / 2
        astray = fit(problem, wrong, LATE_S)
        led = led_along(problem, astray, LATE_S)
    true = true_start(problem)[clearance]
    assert led.misfit < astray.misfit - 50
    assert led.misfit < told.misfit + 30
    # the drops tell it to a third of a standard deviation, from which a fit begun at the truth ends; this began a whole one off
    assert abs(led.point[clearance] - true) < 0.5


def test_clearances_that_are_known_exactly_stay():
    machine = drops.machine()
    with Crew() as crew:
        problem = build_problem(machine, (measured_drop(drops.drop(seconds=0.03), machine),), crew)
    there = linearised(problem, problem.start, FALL_S)
    assert better_clearances(problem, there, FALL_S) is there
    assert beside(problem, there, FALL_S) == []
    assert not np.any(there.point)


def test_a_fit_that_keeps_most_of_what_it_left_beyond_noise_has_hardly_gained():
    def fit_leaving(misfit):
        return Fit(np.zeros(1), (), (), misfit)

    assert hardly_gained(fit_leaving(200.0), fit_leaving(195.0), 100.0)
    assert not hardly_gained(fit_leaving(200.0), fit_leaving(150.0), 100.0)
    assert hardly_gained(fit_leaving(90.0), fit_leaving(90.0), 100.0)
