"""A record whose time axis has holes, as the fit sees it (shipped synthetic drop, samples cut out)."""

from __future__ import annotations

import numpy as np
import pytest
from tdbsim.errors import InputError
from tdbsim.machine import load_machine

from tdbmon.identify.crew import Crew
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.problem import build_problem
from tdbmon.record.read import read
from tdbmon.shipped import shipped

HORIZON = 0.06


@pytest.fixture(scope="module")
def machine():
    return load_machine(shipped("years/machine.toml"))


@pytest.fixture(scope="module")
def record():
    return read(shipped("years/drop_01.nc"))


@pytest.fixture(scope="module")
def whole(record, machine):
    return predicted(record, machine)


def without(record, begin, end):
    """The record without what lies between two instants, s."""
    time = record.time.to_numpy()
    return record.isel(time=(time < begin) | (time >= end))


def predicted(record, machine):
    """The drop, the times of what is simulated of it, what the probes would read at the nominal values, and what is left."""
    drop = measured_drop(record, machine)
    with Crew() as crew:
        problem = build_problem(machine, (drop,), crew)
        found = problem.simulated(problem.start, 0, HORIZON)
    return drop, drop.time[found.span], found.readings, found.left


@pytest.mark.parametrize("begin", [0.6, 1.8])
def test_a_pause_after_what_is_followed_changes_no_value(record, whole, machine, begin):
    drop, time, readings, left = predicted(without(record, begin, begin + 0.3), machine)
    assert drop.interval == pytest.approx(whole[0].interval, rel=1e-12)
    assert drop.seconds == pytest.approx(begin - drop.release, abs=2e-4)  # what follows cannot be counted to
    assert np.ptp(readings) > 500e-6
    assert time == pytest.approx(whole[1], abs=1e-12)
    assert readings == pytest.approx(whole[2], abs=1e-12)
    assert left == pytest.approx(whole[3], abs=1e-12)


def test_a_pause_while_it_levitates_shifts_no_prediction(record, whole, machine):
    """The noise is then of 58 ms of levitation instead of 98."""
    _, _, readings, _ = predicted(without(record, 0.03, 0.04), machine)
    assert readings == pytest.approx(whole[2], abs=0.3e-6)


def test_samples_that_the_time_skips_shift_nothing_after_them(record, whole, machine):
    """Four of them, in the fall and after contacts: counted on, all that follows would be early by so many samples."""
    at = np.searchsorted(whole[0].time, whole[0].release + np.array([0.004, 0.02, 0.021, 0.03]))
    drop, time, readings, _ = predicted(record.isel(time=np.delete(np.arange(record.sizes["time"]), at)), machine)
    assert time == pytest.approx(whole[1], abs=1e-12)
    assert readings == pytest.approx(whole[2], abs=0.3e-6)
    others = np.delete(np.arange(len(whole[0].time)), at)
    assert drop.reading[:, others] == pytest.approx(whole[0].reading[:, others], abs=0.05e-6)


@pytest.mark.parametrize("begin", [0.095, 0.12])
def test_a_pause_in_the_fall_or_the_first_contacts_is_refused(record, machine, begin):
    with pytest.raises(InputError, match=r"no sample has a value between 0\..* released at 0\..*record without pauses"):
        measured_drop(without(record, begin, begin + 0.004), machine)
