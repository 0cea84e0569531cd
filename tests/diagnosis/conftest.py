"""Fixtures: two drops with a wrong probe gain, the models of their contest, and a report."""

import pytest

from tdbmon.diagnosis.contest import contest
from tdbmon.diagnosis.evidence import evidence_of
from tdbmon.diagnosis.suspects import suspects
from tdbmon.identify.crew import Crew
from tdbmon.report.diagnosis_report import build_diagnosis_report
from tests.diagnosis.reported import named_diagnosis
from tests.diagnosis.simulated import problem_of

GAIN = 1.06


@pytest.fixture(scope="session")
def crew():
    with Crew() as opened:
        yield opened


@pytest.fixture(scope="session")
def gained(crew):
    problem = problem_of(crew, f"probe_gain:probe=DE_A,gain={GAIN}")
    return problem, suspects(problem.model.machine, problem.model.machine.probes, ())


@pytest.fixture(scope="session")
def competed(gained):
    problem, everyone = gained
    return contest(problem, everyone, (0.006, 0.012), lambda _: None)


@pytest.fixture(scope="session")
def named(crew):
    return named_diagnosis(crew)


@pytest.fixture(scope="session")
def evidence(named):
    return evidence_of(named)


@pytest.fixture(scope="session")
def report(named):
    return build_diagnosis_report(named, "The records are synthetic.")
