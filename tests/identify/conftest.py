"""Drops of known values, what is to be fitted to them, and their calibration, made once."""

import pytest

from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.problem import build_problem
from tdbmon.identify.stages import Stages
from tests.identify import drops


@pytest.fixture(scope="session")
def problem():
    """One drop of a machine of which little is unknown."""
    machine = drops.machine()
    with Crew() as crew:
        yield build_problem(machine, (measured_drop(drops.drop(), machine),), crew)


@pytest.fixture(scope="session")
def same_model():
    """(machine, records): same-model drops at two speeds."""
    return drops.machine(), [drops.drop(speed=97.0, seed=1), drops.drop(speed=148.0, seed=2)]


@pytest.fixture(scope="session")
def calibration(same_model):
    machine, records = same_model
    return fit_drops(machine, records, horizons=Stages().calibration[:5])  # in small steps, as it is used
