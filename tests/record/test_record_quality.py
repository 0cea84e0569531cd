"""Every fault that is put into a sound synthetic record is found, and nothing in a sound one."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from record_machine import changed, failures, machine

from tdbmon.analysis.analyse import analyse
from tdbmon.record.assign import assign
from tdbmon.record.quality import Check, check, left_out, repair_gaps
from tdbmon.record.read import read

DATASETS = Path(__file__).parents[2] / "datasets"
SHORT = sorted((DATASETS / "short").glob("*.nc"))


@pytest.mark.parametrize("path", [*SHORT, *sorted((DATASETS / "coastdown").glob("*.nc"))], ids=lambda path: path.stem)
def test_sound_records_pass(path: Path) -> None:
    ds = assign(read(path), machine())
    found = check(ds, machine())
    assert [entry for entry in found if not entry.passed] == []
    assert {
        "sampling",
        "nan",
        "dead",
        "unit",
        "clipping",
        "dropout",
        "range",
        "jumps",
        "identical",
        "keyphasor",
        "speed",
    } <= {entry.check for entry in found}
    assert not left_out(ds, machine(), found)


def test_a_record_that_names_another_machine(sound: xr.Dataset) -> None:
    name = machine().name
    unnamed = sound.copy()
    del unnamed.attrs["machine"]
    assert "machine" not in {c.check for c in check(unnamed, machine())}
    for same in (name, f" {name.upper()} ", name.replace(" ", "  ")):
        assert Check("machine", "", True, "the record names this machine") in check(
            sound.assign_attrs(machine=same), machine()
        )
    detail = failures(sound.assign_attrs(machine="Pump 7"))["machine", ""]
    assert "'Pump 7'" in detail and f"'{name}'" in detail


def test_a_date_that_is_not_understood_fails_a_check_that_quotes_it(sound: xr.Dataset) -> None:
    assert "date" not in {found.check for found in check(sound, machine())}
    unread = sound.assign_attrs(drop_time="", drop_time_unread="03/04/2026 06:12:33")
    (told,) = [found for found in check(unread, machine()) if found.check == "date"]
    assert not told.passed
    assert "'03/04/2026 06:12:33'" in told.detail
    assert "2026-04-03T06:12:33 or 2026-03-04T06:12:33" in told.detail


def test_a_probe_at_the_other_end_of_the_shaft_is_told(sound: xr.Dataset) -> None:
    """A position that lacks a digit: every other check passed, and no clearance came out."""
    plan = machine()
    assert not [each for each in check(sound, plan) if each.check == "place"]
    near = plan.touchdown_bearings[0].position + 0.01
    probes = [p.model_copy(update={"position": near}) if p.name == "DE_A" else p for p in plan.probes]
    (told,) = [
        each for each in check(sound, plan.model_copy(update={"probes": tuple(probes)})) if each.check == "place"
    ]
    assert told.channel == "DE_A" and not told.passed
    assert "check position and end of this probe" in told.detail


def test_an_inverted_probe_lets_the_rotor_fall_sideways(sound: xr.Dataset) -> None:
    assert ("fall", "NDE") in failures(changed(sound, "NDE_A", -sound["NDE_A"].values))


def test_swapped_probes_whirl_backward(sound: xr.Dataset) -> None:
    ds = changed(sound, "NDE_A", sound["NDE_B"].values)
    ds = changed(ds, "NDE_B", sound["NDE_A"].values)
    assert "backward" in failures(ds)["whirl", "NDE"]
    assert ("whirl", "NDE") in failures(sound, machine(rotation="cw"))


def test_missing_channels_say_what_follows(sound: xr.Dataset) -> None:
    raw = read(DATASETS / "short" / "drop_100.nc")
    renamed = failures(assign(raw.rename(DE_B="de_b"), machine()))
    assert "unused channels of the file: de_b; did you mean 'de_b'?" in renamed["present", "DE_B"]
    raw = raw.rename(DE_B="other").drop_vars(["keyphasor", "speed"])
    failed = failures(assign(raw, machine()))
    assert "end DE has only 1 of two directions" in failed["present", "DE_B"]
    assert "unused channels of the file: other" in failed["present", "DE_B"]
    assert "no shaft angle" in failed["present", "keyphasor"]
    assert "the speed is not evaluated" in failed["present", "speed"]


def test_gaps_jitter_and_a_slow_clock(sound: xr.Dataset) -> None:
    gap = sound.isel(time=np.r_[0:3000, 3100:10000])
    assert "1 gap in time, the longest 5.05 ms, the first at 0.14995 s" in failures(gap)["sampling", "time"]
    uneven = sound.assign_coords(
        time=sound["time"].values + 2e-6 * np.random.default_rng(4).standard_normal(sound["time"].size)
    )
    assert "intervals vary by" in failures(uneven)["sampling", "time"]
    assert "record at 2 kHz or more" in failures(sound.isel(time=slice(None, None, 20)))["sampling", "time"]
    assert ("sampling", "time") in failures(sound.isel(time=slice(0, 1)))


def test_two_kilohertz_with_rounded_times_are_two_kilohertz(sound: xr.Dataset) -> None:
    slow = sound.isel(time=slice(None, None, 10))
    time = np.arange(slow.sizes["time"]) * 0.5e-3 * (1 + 1e-6)
    assert ("sampling", "time") not in failures(slow.assign_coords(time=time))


def test_pulses_that_are_missed_or_absent(sound: xr.Dataset) -> None:
    values = sound["keyphasor"].values.copy()
    values[3000:3200] = 0.0
    assert "1 missed" in failures(changed(sound, "keyphasor", values))["keyphasor", "keyphasor"]
    none = failures(changed(sound, "keyphasor", np.zeros(values.size)))
    assert "no shaft angle" in none["keyphasor", "keyphasor"]
    assert ("dead", "keyphasor") in none


def test_a_pulse_that_was_missed_in_a_gap_of_time_accuses_no_sensor(sound: xr.Dataset) -> None:
    """A gap of 10 ms, as long as a turn: the check said to look at the sensor's gap and the mark."""
    kept = np.ones(sound["time"].size, dtype=bool)
    kept[3000:3200] = False
    holed = sound.isel(time=kept)
    assert ("keyphasor", "keyphasor") not in failures(holed)
    told = next(each for each in check(holed, machine()) if each.check == "keyphasor")
    assert "1 missed" in told.detail
    assert "all missed pulses lie in gaps of the time axis" in told.detail
    assert (
        "check the sensor's gap"
        in failures(changed(holed, "keyphasor", _without_pulse(holed, 4)))["keyphasor", "keyphasor"]
    )


def _without_pulse(ds: xr.Dataset, number: int) -> np.ndarray:
    values = ds["keyphasor"].values.copy()
    rise = np.flatnonzero(np.diff((values > 0.5).astype(int)) > 0)[number]
    values[rise : rise + 60] = 0
    return values


def test_a_wheel_with_more_marks_than_the_record_has_pulses_is_doubted(sound: xr.Dataset) -> None:
    wheel = machine(keyphasor={"channel": "keyphasor", "pulses_per_revolution": 60})
    said = failures(sound, wheel)["keyphasor", "keyphasor"]
    assert re.match(r"4\d pulses at 60 per revolution are too few", said)
    assert "check pulses_per_revolution = 60" in said


@pytest.mark.parametrize(("hz", "until", "fails"), [(10.0, 0.5, False), (10.0, 0.31, True), (1000.0, 0.4, True)])
def test_a_slow_channel_ends_an_interval_early_without_fault(
    hz: float, until: float, fails: bool, sound: xr.Dataset
) -> None:
    time, values = sound["time"].values, sound["speed"].values
    at = np.searchsorted(time, np.arange(0, until - 1e-9, 1 / hz))
    slow = sound.drop_vars("speed").assign_coords(time_2=("time_2", time[at], sound["time"].attrs))
    slow["speed"] = ("time_2", values[at], sound["speed"].attrs)
    assert (("time base", "speed") in failures(slow)) == fails


def test_a_speed_of_three_values_is_told_to_be_too_little() -> None:
    raw = read(DATASETS / "short" / "drop_100.nc").drop_vars("keyphasor")
    speed = raw["speed"].values
    slow = raw.drop_vars("speed").assign_coords(time_2=("time_2", raw["time"].values[::4000][:3], raw["time"].attrs))
    slow["speed"] = ("time_2", speed[::4000][:3], raw["speed"].attrs)
    found = analyse(slow, machine())
    assert found.rundown is None
    assert any("3 values of the speed in the record; 4 are needed" in each.detail for each in found.checks if not each.passed)


def test_a_record_that_was_cut_off_says_so(sound: xr.Dataset) -> None:
    ds = sound.copy()
    ds.attrs["incomplete"] = "the logger was cut off"
    assert failures(ds)["complete", ""].startswith("the logger was cut off")


def test_short_gaps_are_bridged_and_long_ones_left(sound: xr.Dataset) -> None:
    random = np.random.default_rng(5)
    values = sound["NDE_A"].values.copy()
    starts = 300 + 400 * np.arange(20)
    for start in starts:
        values[start : start + int(random.integers(1, 6))] = np.nan
    values[9000:9006] = np.nan
    values[:3] = np.nan
    out = repair_gaps(changed(sound, "NDE_A", values))
    left = np.flatnonzero(np.isnan(out["NDE_A"].values))
    assert left.tolist() == [0, 1, 2, *range(9000, 9006)]
    assert out["NDE_A"].attrs["nan_left"] == 9
    assert out["NDE_A"].attrs["repaired"] == np.isnan(values).sum() - 9
    kept = np.isfinite(values)
    np.testing.assert_array_equal(out["NDE_A"].values[kept], sound["NDE_A"].values[kept])
    bridged = np.isnan(values) & np.isfinite(out["NDE_A"].values)
    # the bound of the docstring, at 20 kHz and 1000 m/s2, and four standard deviations of noise
    noise = np.std(np.diff(sound["NDE_A"].values[:500]))
    assert np.abs((out["NDE_A"].values - sound["NDE_A"].values)[bridged]).max() < 1000 * (6 / 20e3) ** 2 / 8 + 4 * noise
    assert "repaired" not in out["NDE_B"].attrs


def test_empty_and_tiny_records_end_in_checks_not_in_errors(sound: xr.Dataset) -> None:
    for n in (1, 2, 3, 12, 60):
        found = check(sound.isel(time=slice(0, n)), machine())
        assert all(isinstance(entry, Check) for entry in found)
        assert any(not entry.passed for entry in found)
