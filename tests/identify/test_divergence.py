"""How fast paths part, against paths of the blind generator, which shares no code with the simulator."""

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.identify.crew import Crew
from tdbmon.identify.divergence import divergence, followable, parting_remarks, with_divergence
from tdbmon.identify.drop import USUAL_DIVERGENCE, measured_drop
from tdbmon.identify.prediction import noise_alone
from tdbmon.identify.problem import build_problem
from tdbmon.identify.stages import Stages
from tdbmon.record.read import read
from tests.blind.case import draw_case, simulate, write_drops
from tests.blind.truth import LEAD, RATE, run

SPINDLE, GENERATOR = 72, 310  # seeds


def generators_rate(case):
    """The median rate, 1/s, by which two paths of a drop of the generator part from 8 to 40 ms, faster than in proportion."""
    rng, rates = np.random.default_rng(1), []
    held = round(0.01 * RATE)
    first, last = (held + LEAD + round(t * RATE) for t in (0.008, 0.04))
    for start in case.starts * 8:
        angles = tuple(rng.uniform(0, 2 * np.pi, 2))
        here = replace(start, cage_angle=angles, shaft_angle=float(rng.uniform(0, 2 * np.pi)))
        there = replace(here, set_point=(here.set_point[0] + 1e-11, here.set_point[1] - 1e-11j))
        one, other = (run(case.plain.truth, each, samples=last + 1, levitated=held).places for each in (here, there))
        apart = np.sqrt(np.mean((other - one) ** 2, axis=(1, 2)))
        grown = np.sqrt(np.mean(apart[last - 40 : last] ** 2) / np.mean(apart[first - 40 : first] ** 2))
        rates.append(np.log(grown / (0.04 / 0.008)) / 0.032)
    return float(np.median(rates))


@pytest.fixture(scope="module", params=[SPINDLE, GENERATOR], ids=["spindle", "generator"])
def case(request):
    return draw_case(request.param, kind="none")


@pytest.fixture(scope="module")
def problem(case, tmp_path_factory):
    machine_file, records = write_drops(case, simulate(case), tmp_path_factory.mktemp("drops"))
    machine = load_machine(machine_file)
    with Crew() as crew:
        yield build_problem(machine, tuple(measured_drop(read(path), machine) for path in records), crew)


def test_the_rate_is_that_of_another_simulator(case, problem):
    rate, theirs = divergence(problem), generators_rate(case)
    if case.seed == GENERATOR:
        assert theirs < USUAL_DIVERGENCE * 1.5
        assert rate == USUAL_DIVERGENCE
    else:
        assert theirs > 2 * USUAL_DIVERGENCE
        assert rate == pytest.approx(theirs, rel=0.35)


def test_readings_are_trusted_less_late_where_paths_part_fast(case, problem):
    parted = with_divergence(problem)
    early, late = 0.01, 0.05
    for before, after in zip(problem.drops, parted.drops, strict=True):
        assert noise_alone(after, early) == pytest.approx(noise_alone(before, early), rel=0.02)
        if case.seed == GENERATOR:
            assert noise_alone(after, late) == noise_alone(before, late)
        else:
            assert noise_alone(after, late) < 0.8 * noise_alone(before, late)


def test_a_fit_ends_where_the_models_error_decides_what_touches_next(case, problem):
    parted = with_divergence(problem)
    horizons = followable(parted, Stages().calibration)
    assert horizons == list(Stages().calibration[: len(horizons)])
    assert followable(parted, (0.05,)) == [0.05]
    remarks = parting_remarks(parted, Stages().calibration, horizons)
    if case.seed == GENERATOR:
        assert len(horizons) == len(Stages().calibration)
        assert remarks == ()
    else:
        assert f"fitted to {horizons[-1] * 1e3:g} ms after the release instead of 90 ms" in remarks[0]
        assert 0.022 <= horizons[-1] <= 0.04
        beyond = Stages().calibration[len(horizons)]
        error = 1e-7 * np.exp(parted.drops[0].divergence * (np.array([horizons[-1], beyond]) - 0.008))
        assert error[0] < 0.02 * min(t.gap.nominal for t in case.machine.touchdowns) <= error[1]


def test_the_rate_is_the_same_again(problem):
    assert divergence(problem) == divergence(problem)


def test_a_drop_that_cannot_be_simulated_has_the_usual_rate(problem):
    """All drawn points lie where the levitated shaft touches."""
    narrow = [
        replace(p, nominal=1e-6, low=1e-6, high=1e-6) if p.name.endswith("radial_gap") else p for p in problem.shared
    ]
    assert divergence(replace(problem, shared=tuple(narrow))) == USUAL_DIVERGENCE
