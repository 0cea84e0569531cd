"""A hole in the time axis falsifies no speed (shipped synthetic records with a stretch cut out, or a clock that jumps)."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.rundown import RunDown, fit_rundown
from tdbmon.analysis.unbroken import longest_stretch, stretches
from tdbmon.record.assign import assign
from tdbmon.record.keyphasor import pulses
from tdbmon.record.quality import check
from tdbmon.record.read import read
from tdbmon.shipped import shipped


def _lost(record: xr.Dataset) -> xr.Dataset:
    time = record.time.values
    return record.isel(time=(time < 0.25) | (time >= 0.35))


def _jumped(record: xr.Dataset) -> xr.Dataset:
    time = record.time.values
    return record.assign_coords(time=np.where(time < 0.25, time, time + 0.05))


def _rundown(record: xr.Dataset, machine: Machine, signal: bool = True) -> RunDown:
    time = record.time.values
    speed = record.speed.values if signal else None
    return fit_rundown(time, speed, release_time=0.1, polar_inertia=None, pulses=pulses(record, machine))


@pytest.mark.parametrize("name", ["short/drop_100", "short/drop_210", "loose/drop_150"])
@pytest.mark.parametrize("holed", [_lost, _jumped])
def test_the_scale_of_the_speed_is_that_of_the_whole_record(name, holed, machine):
    record = assign(read(shipped(f"{name}.nc")), machine)
    whole, found = _rundown(record, machine), _rundown(holed(record), machine)
    assert found.initial.value == pytest.approx(whole.initial.value, rel=3e-4)
    assert found.pulse_ratio.value == pytest.approx(1.0, abs=3e-4)


@pytest.mark.parametrize("holed", [_lost, _jumped])
def test_pulses_alone_are_not_counted_across_a_hole(holed, machine):
    record = assign(read(shipped("short/drop_100.nc")), machine)
    whole, found = _rundown(record, machine, signal=False), _rundown(holed(record), machine, signal=False)
    assert found.initial.value == pytest.approx(whole.initial.value, rel=1e-3)
    assert found.initial.high - found.initial.low < 0.5


def test_the_edges_of_a_hole_are_no_steps(machine):
    """The shaft moves by 80 um meanwhile."""
    record = assign(read(shipped("short/drop_100.nc")), machine)
    failed = {found.check for found in check(_lost(record), machine) if not found.passed}
    assert "jumps" not in failed
    assert "sampling" in failed
    record["NDE_A"] = record["NDE_A"].where(record.time < 0.4, record["NDE_A"] + 200e-6)
    assert "jumps" in {found.check for found in check(_lost(record), machine) if not found.passed}


def test_stretches_end_at_holes_of_more_than_a_few_samples():
    time = np.arange(100) * 1e-3
    assert longest_stretch(time, 0.02) == (pytest.approx(0.02), pytest.approx(0.099))
    time = np.delete(time, [30, 31, *range(50, 60)])
    begin, end = stretches(time)
    assert begin == pytest.approx([0.0, 0.06])
    assert end == pytest.approx([0.049, 0.099])
    assert longest_stretch(time, 0.02) == (pytest.approx(0.06), pytest.approx(0.099))


def test_a_pause_in_a_coast_down_falsifies_neither_swing_nor_radius_nor_lines(machine, coastdown_record, coastdown):
    """0.45 s of 85 s: at the mean rate the swing was 0.5 % slow, the radius 3 um too great at both ends, and both agreed."""
    time = coastdown_record.time.values
    found = analyse(coastdown_record.isel(time=(time < 5.0) | (time >= 5.45)), machine)
    for each, whole in zip(found.swing.frequencies, coastdown.swing.frequencies, strict=True):
        assert each.value == pytest.approx(whole.value, rel=1e-3)
    for end, whole in coastdown.ends.items():
        assert found.ends[end].gap.radius.value == pytest.approx(whole.gap.radius.value, abs=0.3e-6)
        assert found.ends[end].gap.agrees
    places = [{line.name: line.frequency.value for line in each.lines} for each in (found, coastdown)]
    assert places[0]["mains"] == pytest.approx(50.0, abs=0.03)
    assert places[0]["swing 1"] == pytest.approx(places[1]["swing 1"], abs=0.02)
    assert places[0]["bounce"] == pytest.approx(places[1]["bounce"], abs=0.2)
