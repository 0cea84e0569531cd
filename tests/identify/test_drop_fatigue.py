"""The fatigue that the archive files of a drop, against that of the simulation which made the record (same model)."""

import numpy as np
import pytest
from tdbsim.fatigue import drop_fatigue

from tdbmon.history.fatigue import REFERENCE, fatigue_of
from tdbmon.identify.stress import ball_stress

SECONDS = 0.03


@pytest.fixture(scope="module")
def found(calibration):
    return [fatigue_of(calibration, drop, SECONDS, members=12) for drop in range(2)]


def test_the_intervals_hold_what_the_balls_went_through(found, same_model):
    machine, records = same_model
    for each, record in zip(found, records, strict=True):
        release = record.attrs["release_time_s"]
        part = record.ball_load.sel(time=slice(release, release + SECONDS))
        for end, bearing in zip(machine.ends, machine.touchdown_bearings, strict=True):
            true = drop_fatigue(ball_stress(bearing, part.sel(end=end).values), REFERENCE).worst
            assert true > 0.1  # it does hit
            assert each[end].low < true < each[end].high
            assert each[end].value == pytest.approx(true, rel=0.5)


def test_it_counts_more_than_one_cycle_at_the_greatest_stress(found, same_model):
    machine, records = same_model
    for each, record in zip(found, records, strict=True):
        release = record.attrs["release_time_s"]
        part = record.ball_load.sel(time=slice(release, release + SECONDS))
        for end, bearing in zip(machine.ends, machine.touchdown_bearings, strict=True):
            greatest = ball_stress(bearing, part.sel(end=end).values).max()
            assert each[end].value > 0.5 * (greatest / REFERENCE) ** 9


def test_a_calibration_that_cannot_be_simulated_is_told(calibration):
    from dataclasses import replace

    apart = replace(calibration, point=np.full_like(calibration.point, 1e9), covariance=0 * calibration.covariance)
    for each in fatigue_of(apart, members=4).values():
        assert "can be simulated" in each.why
