"""Records that begin while the shaft lies on its touchdown bearings and is then levitated."""

import numpy as np
import pytest
import xarray as xr

from tdbmon.analysis.analyse import analyse
from tdbmon.identify.drop import measured_drop
from tdbmon.record.assign import assign
from tdbmon.record.lift_off import from_lift_off
from tdbmon.record.read import read
from tdbmon.shipped import shipped

PROBES = ("NDE_A", "NDE_B", "DE_A", "DE_B")
SPEED_HZ = 95.85  # before the release
LIES_S, LIFTED_S = 0.3, 0.2  # before the record of the drop


@pytest.fixture(scope="module")
def drop(machine):
    return read(shipped("short/drop_100.nc")).load()


@pytest.fixture(scope="module")
def lifted(drop):
    """The drop, preceded by its own end, by how it is lifted from there, and by its own levitation; by how much, s."""
    time = drop.time.values
    step = time[1] - time[0]
    turns = np.tile(np.arange(round(8 / SPEED_HZ / step)), 10)
    lead = turns.size
    out = drop.isel(time=np.concatenate([turns, np.arange(time.size)]))
    out = out.assign_coords(time=step * np.arange(out.sizes["time"]))
    lies = np.interp(out.time.values[:lead], [LIES_S, LIES_S + LIFTED_S], [1.0, 0.0])
    for name in PROBES:
        values = out[name].values.copy()
        rest = np.resize(drop[name].values[-round(0.3 / step) :], lead)
        values[:lead] = lies * rest + (1 - lies) * values[:lead]
        out[name] = out[name].copy(data=values)
    return out, lead * step


def test_the_drop_is_that_of_a_record_that_begins_in_levitation(drop, lifted, machine):
    record, before = lifted
    plain, found = analyse(drop, machine), analyse(record, machine)
    (row,) = (check for check in found.checks if check.check == "lift-off")
    assert not row.passed and "cut the record at 0." in row.detail
    assert plain.release.time.low < found.release.time.value - before < plain.release.time.high
    for end, result in plain.ends.items():
        assert found.ends[end].air_gap.value == pytest.approx(result.air_gap.value, abs=1e-6)
        touched = found.ends[end].contacts.first.touch.value
        assert touched == pytest.approx(result.contacts.first.touch.value + before, abs=5e-5)


def test_a_fit_takes_the_drop_alone(drop, lifted, machine):
    record, before = lifted
    plain, found = measured_drop(drop, machine), measured_drop(record, machine)
    assert found.release == pytest.approx(plain.release + before, abs=5e-5)
    assert found.omega == pytest.approx(plain.omega, rel=3e-3)
    # the tiled levitation does not slow as the record does, and the joint adds a little to the noise
    assert [each.sigma for each in found.noise] == pytest.approx([each.sigma for each in plain.noise], rel=0.3)
    assert [("cut the record at 0." in each) for each in (*plain.faults, *found.faults)].count(True) == 1


def test_what_begins_in_levitation_or_after_the_release_is_left_as_it_is(drop, machine):
    laid = assign(drop, machine)
    for record in (laid, laid.sel(time=slice(0.13, None)), laid.sel(time=slice(0.4, None))):
        same, checks = from_lift_off(record, machine)
        assert same is record and not checks


@pytest.mark.filterwarnings("error")
def test_a_stretch_without_values_of_a_shaft_that_lies_throughout_is_no_lift_off(machine):
    """It was cut there, 0.3 s after its start."""
    time = np.arange(10_000) * 1e-4
    angle = 0.2 * np.sin(2 * np.pi * 30 * time)
    x, y = 280e-6 * np.sin(angle), -280e-6 * np.cos(angle)
    record = xr.Dataset(coords={"time": time})
    for probe in machine.probes:
        seen = x * np.cos(probe.angle) + y * np.sin(probe.angle)
        record[probe.name] = ("time", np.where((time > 0.3) & (time < 0.45), np.nan, seen), {"units": "m"})
    same, checks = from_lift_off(record, machine)
    assert same is record and not checks


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "lost", [(0.55, 0.56), (-0.16, -0.01)], ids=["while it levitates", "on the orbit before the fall"]
)
def test_a_lift_off_is_found_though_values_lack(lost, lifted, machine):
    record, before = lifted
    laid = assign(record, machine)
    whole, _ = from_lift_off(laid, machine)
    since = before + 0.1 if lost[0] < 0 else 0.0  # of the release
    time = laid.time.values - since
    for name in PROBES:
        laid[name] = laid[name].where((time < lost[0]) | (time > lost[1]))
    cut, checks = from_lift_off(laid, machine)
    assert [each.check for each in checks] == ["lift-off"]
    assert float(cut.time[0]) == pytest.approx(float(whole.time[0]), abs=LIFTED_S)
