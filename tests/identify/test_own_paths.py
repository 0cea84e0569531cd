"""A drop's path sought with the shared values held; synthetic drops by the model's own simulator."""

import pytest

from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import fit, linearised
from tdbmon.identify.own_paths import best_paths, better_paths, lost_drops
from tdbmon.identify.prediction import noise_alone, window
from tdbmon.identify.problem import build_problem
from tests.identify import drops

HORIZON = 0.027  # s


@pytest.fixture(scope="module")
def fitted():
    """Three drops and the fit that explains them."""
    machine = drops.machine()
    with Crew() as crew:
        records = [drops.drop(speed=speed, seed=seed) for speed, seed in ((97.0, 1), (60.0, 2), (150.0, 3))]
        problem = build_problem(machine, tuple(measured_drop(each, machine) for each in records), crew)
        point = problem.start
        for horizon in (0.006, 0.01, 0.014, 0.018, 0.022):
            point = fit(problem, point, horizon).point
        yield problem, fit(problem, point, HORIZON)


def test_noise_is_left_where_the_model_is_right(fitted):
    problem, right = fitted
    assert lost_drops(problem, right, HORIZON) == []


def test_noise_leaves_the_less_the_more_a_model_may_err(fitted):
    problem, _ = fitted
    drop = problem.drops[0]
    shares = [noise_alone(drop, h) / (len(drop.probes) * window(drop, h)[1]) for h in (0.006, 0.027, 0.06)]
    assert 1 > shares[0] > shares[1] > shares[2] > 0


def test_a_drop_that_fell_on_another_ball_is_led_back(fitted):
    problem, right = fitted
    cage = len(problem.shared) + [p.name for p in problem.own[2]].index("cage_0")
    astray = right.point.copy()
    astray[problem.columns(2)[cage]] += 1.0  # half a ball's spacing
    strayed = fit(problem, astray, HORIZON)
    assert strayed.misfit > right.misfit + 30  # much for one angle, but as noise may leave
    led = better_paths(problem, strayed, HORIZON, [2])
    assert led.misfit < right.misfit + 5


def test_drops_that_lost_their_ways_are_led_back_together_and_sound_ones_are_left_alone(fitted):
    problem, right = fitted
    assert best_paths(problem, right, HORIZON) is right
    astray = right.point.copy()
    for drop in (0, 2):
        cage = len(problem.shared) + [p.name for p in problem.own[drop]].index("cage_0")
        astray[problem.columns(drop)[cage]] += 1.0
    strayed = linearised(problem, astray, HORIZON)
    assert lost_drops(problem, strayed, HORIZON) == [0, 2]
    led = best_paths(problem, strayed, HORIZON)
    assert lost_drops(problem, led, HORIZON) == []
    assert led.misfit < 1.003 * right.misfit  # as little as asks for no more
