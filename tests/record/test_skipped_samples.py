"""Samples that a time axis skips."""

import numpy as np
import pytest
import xarray as xr

from tdbmon.record.skipped_samples import with_skipped_samples
from tdbmon.record.timebase import usual_interval

INTERVAL = 1e-3 / 12.8  # no whole number of microseconds


def record_without(lost):
    time = np.delete(np.arange(200) * INTERVAL, lost)
    data = {"a": ("time", np.sin(300 * time), {"units": "m"})}
    return xr.Dataset(data, coords={"time": ("time", time, {"units": "s"})}, attrs={"source_file": "made up"})


@pytest.mark.parametrize("digits", [9, 6])
def test_up_to_five_skipped_samples_are_missing_ones_and_more_are_a_hole(digits):
    lost = [30, *range(60, 65), *range(100, 110)]
    holed = record_without(lost)
    holed = holed.assign_coords(time=("time", np.round(holed.time.values, digits), holed.time.attrs))
    found = with_skipped_samples(holed)
    assert found.time.to_numpy() == pytest.approx(
        np.delete(np.arange(200) * INTERVAL, np.arange(100, 110)), abs=1.01 * 10.0**-digits
    )
    assert np.flatnonzero(found["a"].isnull()).tolist() == [30, *range(60, 65)]
    assert found["a"].dropna("time").equals(holed["a"])
    assert found.attrs == holed.attrs and found.time.attrs == holed.time.attrs and found["a"].attrs == holed["a"].attrs


def test_a_sound_record_is_left_as_it_is():
    record = record_without([])
    assert with_skipped_samples(record) is record


def test_holes_do_not_stretch_the_usual_interval():
    time = record_without([3, *range(50, 90)]).time.to_numpy()
    assert usual_interval(time) == pytest.approx(INTERVAL, rel=1e-12)
    even = np.arange(7, 5000) / 12.8e3
    assert usual_interval(even) == (even[-1] - even[0]) / (len(even) - 1)
