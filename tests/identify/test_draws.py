"""Points drawn from what a fit leaves open."""

import numpy as np
import pytest

from tdbmon.identify.crew import Crew
from tdbmon.identify.draws import draws, shaken
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.least_squares import covariance_of, fit, information, linearised
from tdbmon.identify.problem import build_problem
from tests.identify import drops

HORIZON = 0.022


@pytest.fixture(scope="module")
def hollow():
    """A problem, and a fit that went the whole way at once and stuck on it."""
    machine = drops.machine()
    with Crew() as crew:
        problem = build_problem(machine, (measured_drop(drops.drop(seconds=0.03), machine),), crew)
        yield problem, fit(problem, problem.start, HORIZON, 3)


def test_a_deeper_hollow_is_found(hollow):
    problem, stuck = hollow
    found = shaken(problem, stuck, HORIZON)
    assert stuck.misfit > 1.5 * len(stuck.residuals[0])
    assert found.misfit < 0.8 * stuck.misfit


def test_draws_have_the_covariance_and_stay_within_bounds(hollow):
    problem, stuck = hollow
    covariance = covariance_of(problem, stuck, HORIZON)
    first, *drawn = draws(problem, stuck.point, covariance, 400, np.random.default_rng(3))
    assert np.array_equal(first, stuck.point)
    assert all(((each >= problem.low) & (each <= problem.high)).all() for each in drawn)
    middle = [k for k, p in enumerate(problem.parameters) if p.name.startswith("zero_")]
    spread = np.std(drawn, axis=0)[middle]
    assert spread == pytest.approx(np.sqrt(np.diag(covariance))[middle], rel=0.15)


def test_information_is_how_much_noise_tells_of_a_step(hollow):
    """What a small step changes of all residuals, with what is known beforehand, is d^T I d."""
    problem, stuck = hollow
    stands = linearised(problem, stuck.point, HORIZON)
    known = information(problem, stands)
    smooth = [k for k, p in enumerate(problem.parameters) if p.name.startswith(("zero_", "NDE.runout", "DE.runout"))]
    rng = np.random.default_rng(7)
    step = np.zeros(len(stuck.point))
    step[smooth] = 0.1 * rng.standard_normal(len(smooth))
    (moved,) = problem.all_residuals(stuck.point + step, HORIZON)
    prior = np.where(problem.prior > 0, problem.prior, 1e-6)
    assert step @ known @ step == pytest.approx(((moved - stands.residuals[0]) ** 2).sum() + prior @ step**2, rel=0.01)
    assert np.diag(known)[smooth].min() > 1.0  # so the record says more than nothing of each
