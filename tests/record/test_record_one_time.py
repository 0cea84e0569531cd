"""Probes on several time bases: what agrees is analysed together, and what was done to it is said (synthetic records)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from record_machine import machine
from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.identify.drop import measured_drop
from tdbmon.record.assign import assign
from tdbmon.record.one_time import HARD_CONTACT
from tdbmon.record.quality import Check, check, left_out
from tdbmon.record.read import read
from tdbmon.shipped import shipped

SOURCE = shipped("short/drop_100.nc")
NAMES = ("NDE_A", "NDE_B", "DE_A", "DE_B")


def _on(raw: xr.Dataset, dimension: str, name: str, keep: slice = slice(None), late: float = 0.0) -> xr.Dataset:
    """Return the record with one channel on a time base of its own: some of its samples, and later by `late` s."""
    time, array = raw["time"].values[keep] + late, raw[name]
    own = xr.DataArray(array.values[keep], dims=(dimension,), coords={dimension: time}, attrs=array.attrs)
    return raw.drop_vars(name).assign({name: own})


def _checks(raw: xr.Dataset, kind: str = "time base") -> list[Check]:
    return [found for found in check(assign(raw, machine()), machine()) if found.check == kind]


@pytest.mark.parametrize(("missing", "passed"), [(1, True), (50, True), (3000, False)])
def test_a_probe_that_stopped_sooner_cuts_the_others_to_what_all_have(missing: int, passed: bool) -> None:
    raw = read(SOURCE)
    n = raw["time"].size - missing
    laid = assign(_on(raw, "time_2", "NDE_B", slice(0, n)), machine())
    assert {laid[name].dims for name in NAMES} == {("time",)}
    assert laid.sizes["time"] == n
    for name in NAMES:
        np.testing.assert_array_equal(laid[name].values, raw[name].values[:n])
    assert laid["keyphasor"].size == raw["time"].size  # what needs no common time keeps all its samples
    found = [each for each in check(laid, machine()) if each.check == "time base"]
    assert [(each.channel, each.passed) for each in found] == [("NDE_B", passed)]
    assert f"{missing} of {n + missing} samples are left out" in found[0].detail


def test_probes_that_lack_samples_at_either_side_are_both_told() -> None:
    raw = _on(_on(read(SOURCE), "time_2", "NDE_B", slice(0, -400)), "time_3", "DE_A", slice(300, None))
    laid = assign(raw, machine())
    np.testing.assert_array_equal(laid["DE_B"].values, read(SOURCE)["DE_B"].values[300:-400])
    np.testing.assert_array_equal(laid["DE_A"].values, read(SOURCE)["DE_A"].values[300:-400])
    assert [found.channel for found in _checks(raw)] == ["NDE_B", "DE_A"]


def test_a_record_with_a_sample_less_of_one_probe_has_its_orbit() -> None:
    whole = load_machine(SOURCE.parent / "machine.toml")
    raw = read(SOURCE)
    short = _on(raw, "time_2", "NDE_B", slice(0, -1))
    found = analyse(short, whole)
    assert found.planes is not None
    assert list(found.planes.plane.values) == ["bearing", "bearing"]
    assert measured_drop(short, whole).release == pytest.approx(measured_drop(raw, whole).release, abs=1e-6)


@pytest.mark.parametrize("late_us", [-20.0, -6.25, 6.25, 25.0])
def test_a_multiplexed_probe_is_read_at_the_times_of_the_others(late_us: float) -> None:
    raw = read(SOURCE)
    time = raw["time"].values
    smooth = 200e-6 * np.sin(2 * np.pi * 100 * time)
    raw["NDE_B"] = raw["NDE_B"].copy(data=200e-6 * np.sin(2 * np.pi * 100 * (time + late_us * 1e-6)))
    raw = _on(raw, "time_2", "NDE_B", late=late_us * 1e-6)
    laid = assign(raw, machine())
    assert laid["NDE_B"].dims == laid["NDE_A"].dims
    expected = np.interp(laid["time"].values, time, smooth)
    bound = 200e-6 * (2 * np.pi * 100) ** 2 * 50e-6**2 / 8  # a h^2 / 8
    np.testing.assert_allclose(laid["NDE_B"].values, expected, rtol=0, atol=1.01 * bound)
    found = _checks(raw)
    assert [(each.channel, each.passed) for each in found] == [("NDE_B", True)]
    assert f"{abs(late_us):.3g} us {'after' if late_us > 0 else 'before'} NDE_A" in found[0].detail


@pytest.mark.parametrize("path", sorted(SOURCE.parent.glob("drop_*.nc")), ids=lambda path: path.stem)
def test_a_hard_contact_accelerates_the_shaft_by_about_what_is_said(path: Path) -> None:
    raw = read(path)
    reach = round(5e-4 / float(raw["time"][1] - raw["time"][0]))
    curved = [raw[n].values[2 * reach :] - 2 * raw[n].values[reach:-reach] + raw[n].values[: -2 * reach] for n in NAMES]
    hardest = max(float(np.max(np.abs(each))) for each in curved) / 5e-4**2
    assert HARD_CONTACT / 3 < hardest < HARD_CONTACT


def test_straight_lines_do_not_lead_over_what_is_missing() -> None:
    raw = read(SOURCE)
    values = raw["NDE_B"].values.copy()
    values[500] = np.nan
    raw["NDE_B"] = raw["NDE_B"].copy(data=values)
    keep = np.r_[0:700, 710:9000]
    time = raw["time"].values[keep] + 10e-6
    own = xr.DataArray(values[keep], dims=("time_2",), coords={"time_2": time}, attrs=raw["NDE_B"].attrs)
    laid = assign(raw.drop_vars("NDE_B").assign(NDE_B=own), machine())
    lost = laid["time"].values[np.isnan(laid["NDE_B"].values)]
    np.testing.assert_allclose(lost[:2], raw["time"].values[[500, 501]])
    np.testing.assert_allclose(lost[2:], raw["time"].values[700:711])


def test_of_two_rates_the_end_that_agrees_and_is_faster_is_analysed() -> None:
    raw = read(SOURCE)
    for name in ("NDE_A", "NDE_B"):
        raw = _on(raw, "time_2", name, slice(None, None, 2))
    laid = assign(raw, machine())
    checks = check(laid, machine())
    assert set(left_out(laid, machine(), checks)) == {"NDE_A", "NDE_B"}
    found = [each for each in checks if each.check == "time base"]
    assert [(each.channel, each.passed) for each in found] == [("NDE_A, NDE_B", False)]
    assert "NDE_A, NDE_B at 10000 Hz" in found[0].detail
    assert "DE_A, DE_B at 20000 Hz" in found[0].detail
    result = analyse(raw, load_machine(SOURCE.parent / "machine.toml"))
    assert result.planes is not None
    assert list(result.planes.plane.values) == ["none", "probe"]


def test_a_pair_goes_before_a_faster_probe_alone() -> None:
    raw = read(SOURCE)
    for name in ("NDE_B", "DE_A", "DE_B"):
        raw = _on(raw, "time_2", name, slice(None, None, 2))
    laid = assign(raw, machine())
    assert set(left_out(laid, machine(), check(laid, machine()))) == {"NDE_A"}


def test_a_probe_with_little_of_the_record_does_not_cut_the_others() -> None:
    raw = read(SOURCE)
    laid = assign(_on(raw, "time_2", "DE_B", slice(0, 2500)), machine())
    assert laid["NDE_A"].size == raw["time"].size
    checks = check(laid, machine())
    assert set(left_out(laid, machine(), checks)) == {"DE_B"}
    assert [each.channel for each in checks if each.check == "time base"] == ["DE_B"]


def test_a_slow_speed_channel_is_no_fault_and_bears_its_name() -> None:
    raw = _on(read(SOURCE), "time_2", "speed", slice(None, None, 100))
    found = _checks(raw, "sampling")
    assert [(each.channel, each.passed) for each in found] == [
        ("NDE_A, NDE_B, DE_A, DE_B, keyphasor", True), ("speed", True),
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["keyphasor", "speed"])
def test_a_keyphasor_that_ends_long_before_the_probes_is_told(name: str) -> None:
    found = _checks(_on(read(SOURCE), "time_2", name, slice(0, 1953)))
    assert [(each.channel, each.passed) for each in found] == [(name, False)]
    assert "ends at 0.0976 s, but the probes end at 0.49995 s" in found[0].detail


@pytest.mark.parametrize("path", sorted(Path(SOURCE).parent.glob("*.nc")), ids=lambda path: path.stem)
def test_a_record_on_one_time_base_is_left_as_it_is(path: Path) -> None:
    raw = read(path)
    laid = assign(raw, machine())
    assert _checks(raw) == []
    for name in NAMES:
        np.testing.assert_array_equal(laid[name].values, raw[name].values)


def test_a_probe_with_a_clock_of_its_own_is_said_to_have_one() -> None:
    """100 ppm are a sample over the record, and were told as 0 us."""
    raw = read(SOURCE)
    time = raw["time"].values
    own = raw["NDE_B"].copy(data=raw["NDE_B"].values).rename(time="time_2").assign_coords(time_2=1.0001 * time)
    (found,) = _checks(raw.drop_vars("NDE_B").assign(NDE_B=own))
    assert "by a clock that drifts relative to that of NDE_A by 50 us over the record" in found.detail
