"""Drops of known values, what is to be fitted to them, their calibration and the report of one, made once."""

from dataclasses import replace

import pytest

from tdbmon.analysis.analyse import analyse
from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.fitted import FittedDrop
from tdbmon.identify.forces import forces_of
from tdbmon.identify.problem import build_problem
from tdbmon.identify.stages import Stages
from tdbmon.report import build_report
from tdbmon.report.document import Document
from tests.identify import drops
from tests.identify.spectral_line import line


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


@pytest.fixture(scope="session")
def analysed(same_model):
    return analyse(same_model[1][0], drops.machine())


@pytest.fixture(scope="session")
def fitted(calibration):
    first, *others = forces_of(calibration, seconds=0.05, members=8)
    return FittedDrop(calibration, first, others=tuple(others))


@pytest.fixture(scope="session")
def report(analysed, fitted) -> Document:
    hz = [float(mode.frequency.value or 0.0) for mode in fitted.natural_frequencies.modes]
    lines = (line("swing 1", 1.004 * hz[0]), line("2 x swing 1", hz[1]), line("bounce", 0.99 * hz[2]))
    lines += (line("mains", hz[3], "mains"),)
    return build_report(replace(analysed, lines=lines), fitted=fitted)
