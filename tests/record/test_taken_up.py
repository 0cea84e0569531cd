"""Drops after which the magnetic bearings take the rotor up again: the drop is told, up to the lift, whose instant is named."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from tdbsim.machine import load_machine
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.analyse import analyse
from tdbmon.identify.drop import measured_drop
from tdbmon.record.assign import assign
from tdbmon.record.read import read
from tdbmon.record.taken_up import until_taken_up
from tdbmon.report.drop_report import build_report
from tdbmon.shipped import shipped

RELEASE_S, LAST_S = 0.1, 2.1
LIFT_S = 1.5


@pytest.fixture(scope="module")
def drop(machine):
    sensors = SensorChain(probe=ProbeChain(noise=0.25e-6, hum=0.1e-6), speed_noise_hz=0.05, keyphasor_width=0.1)
    plan = DropPlan(120.0, LAST_S - RELEASE_S, levitated=RELEASE_S, sampling=10_000.0, sensors=sensors, seed=5)
    return simulate(machine, plan)


def lifted(record, machine, since, takes, beside=0.0):
    """The record with the shaft lifted to where it levitated, or `beside` it, from `since` on; smoothly, in `takes` s."""
    out = record.copy()
    time = record.time.values
    up = np.clip((time - since) / takes, 0, 1)
    up = up**2 * (3 - 2 * up)
    held = np.arange(time.size) % int(0.98 * RELEASE_S * 10_000)
    for probe in machine.probes:
        values = record[probe.name].values
        out[probe.name] = record[probe.name].copy(data=(1 - up) * values + up * (values[held] + beside))
    return out


@pytest.mark.parametrize(("since", "takes", "beside"), [(1.5, 0.05, 0.0), (1.5, 0.3, 8e-6), (0.9, 0.6, 0.0)])
def test_the_instant_of_the_lift_is_told(drop, machine, since, takes, beside):
    cut, (row,) = until_taken_up(assign(lifted(drop, machine, since, takes, beside), machine), machine)
    assert row.check == "lifted again" and not row.passed and "AC" not in row.detail
    assert float(cut.time[-1]) == pytest.approx(since, abs=0.12 * takes + 0.03)
    assert f"cut the record at {cut.attrs['lifted_s']:.4g} s" in row.detail


def test_the_drop_is_analysed_up_to_the_lift(drop, machine):
    whole, found = analyse(drop, machine), analyse(lifted(drop, machine, LIFT_S, 0.2), machine)
    assert [check.check for check in found.checks if not check.passed] == ["lifted again"]
    for name, end in whole.ends.items():
        assert found.ends[name].contacts.first.touch.value == pytest.approx(end.contacts.first.touch.value, abs=2e-4)
        assert found.ends[name].gap.radius.value == pytest.approx(end.gap.radius.value, abs=8e-6)
    assert [phase.name for phase in found.phases][-2:] == ["run-down", "levitated again"]
    assert found.phases[-1].start == pytest.approx(LIFT_S, abs=0.05)
    assert found.phases[-1].end == pytest.approx(LAST_S, abs=1e-3)
    measured = measured_drop(lifted(drop, machine, LIFT_S, 0.2), machine)
    assert any("lifted off" in fault for fault in measured.faults)


@pytest.mark.parametrize("since_ms", [104.0, 110.0])
def test_bounces_are_no_lift_where_the_record_begins_in_the_fall(since_ms):
    """Cut so, the first 5 ms span a good part of the gap, and small bounces stay within that of where they began."""
    machine = load_machine(shipped("short/machine.toml"))
    for name in ("short/drop_100", "short/drop_150"):
        late = read(shipped(f"{name}.nc")).load().sel(time=slice(since_ms * 1e-3, None))
        assert until_taken_up(assign(late, machine), machine)[1] == []


def test_a_lift_is_told_of_a_shaft_that_levitates_on_a_wide_orbit(drop, machine):
    """By how far it turns about the middle of its orbit, not about a point on it."""
    time = drop.time.values
    wide = drop.copy()
    for probe in machine.probes:
        turning = 50e-6 * np.cos(2 * np.pi * 120 * time - probe.angle) * (time < RELEASE_S)
        wide[probe.name] = drop[probe.name].copy(data=drop[probe.name].values + turning)
    _, (row,) = until_taken_up(assign(lifted(wide, machine, LIFT_S, 0.2), machine), machine)
    assert row.check == "lifted again"


def test_a_report_of_it_is_written(drop, machine):
    document = build_report(analyse(lifted(drop, machine, LIFT_S, 0.2), machine))
    assert "levitated again" in str(document)


def test_a_shaft_that_lies_and_a_high_pass_are_no_lift(drop, machine):
    laid = assign(drop, machine)
    assert until_taken_up(laid, machine) == (laid, [])
    for corner_hz in (0.5, 1.0, 3.0, 10.0):
        keeps = np.exp(-2 * np.pi * corner_hz * 1e-4)
        coupled = laid.copy()
        for probe in machine.probes:
            values = laid[probe.name].values
            coupled[probe.name] = laid[probe.name].copy(
                data=lfilter([1.0, -1.0], [1.0, -keeps], values - values[:200].mean())
            )
        assert until_taken_up(coupled, machine)[1] == []


def test_times_in_ms_read_as_s_are_no_lift():
    """A drop of 0.5 s was cut at 112 s, where it swung high for two samples."""
    record = read(shipped("short/drop_100.nc"))
    slow = record.assign_coords(time=1e3 * record.time.values)
    machine = load_machine(shipped("short/machine.toml"))
    cut, rows = until_taken_up(assign(slow, machine), machine)
    assert rows == []
    assert cut.sizes == assign(slow, machine).sizes
