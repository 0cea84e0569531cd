"""A speed counted twice a revolution contradicts the levitated shaft, and an elliptical surface does not (synthetic records)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from record_machine import machine
from tdbsim.errors import InputError

from tdbmon.analysis.analyse import analyse
from tdbmon.identify.drop import measured_drop
from tdbmon.record.assign import assign
from tdbmon.record.levitated_lines import levitated_lines
from tdbmon.record.miscounted import Miscounted, miscounted
from tdbmon.record.quality import Check, check
from tdbmon.record.read import read
from tdbmon.record.speed_checks import refuted

DATASETS = Path(__file__).parents[2] / "datasets"
RECORDS = [*sorted((DATASETS / "short").glob("*.nc")), DATASETS / "years" / "drop_01.nc"]
PROBES = ("NDE_A", "NDE_B", "DE_A", "DE_B")
RATE = 20_000.0


def _miscounted(path: Path, count: int, without: str = "") -> xr.Dataset:
    """A record whose counter takes each of several marks for a revolution."""
    raw = read(path)
    time, hz = raw["time"].values, raw["speed"].values
    turns = np.cumsum(hz) * (time[1] - time[0])
    raw["speed"] = raw["speed"].copy(data=count * hz)
    raw["keyphasor"] = raw["keyphasor"].copy(data=(count * turns % 1 < 0.1).astype(float))
    return raw.drop_vars(without) if without else raw


def _speed_check(ds: xr.Dataset) -> Check:
    return next(found for found in check(ds, machine()) if found.check == "speed")


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem)
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("without", ["", "speed", "keyphasor"])
def test_a_speed_counted_too_often_is_told_and_left_out(path: Path, count: int, without: str) -> None:
    found = _speed_check(ds := assign(_miscounted(path, count, without), machine()))
    assert not found.passed
    assert f"{count} marks or pulses per revolution" in found.detail
    assert "left out: the speed is not evaluated" in found.detail
    assert set(refuted(ds, machine())) == {"speed", "keyphasor"} - {without}


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem)
def test_the_pulses_of_a_toothed_wheel_are_doubted_with_the_cure(path: Path) -> None:
    ds = _miscounted(path, 6, "speed")
    found = _speed_check(assign(ds, machine()))
    assert not found.passed
    assert "pulses_per_revolution = 6" in found.detail
    wheel = machine(keyphasor={"channel": "keyphasor", "pulses_per_revolution": 6})
    signal = read(path)["speed"]
    told = analyse(ds, wheel)
    stated = np.interp(told.speed_time, signal["time"].values, signal.values)
    assert np.median(told.speed_hz / stated) == pytest.approx(1.0, rel=1e-3)
    assert all(each.passed for each in check(assign(ds, wheel), wheel) if each.check == "speed")
    drop = measured_drop(ds, wheel)  # the speed is told, the shaft's angle is not
    there = float(np.median(signal.values[np.abs(signal["time"].values - drop.release) < 5e-3]))
    assert drop.omega / (2 * np.pi) == pytest.approx(there, rel=2e-3)
    assert np.isinf(drop.angle_sigma)


def test_a_wheel_beside_a_right_speed_signal_is_no_wrong_unit() -> None:
    raw, right = _miscounted(RECORDS[1], 6), read(RECORDS[1])
    raw["speed"] = right["speed"]
    assert "6 pulses per revolution" in _speed_check(assign(raw, machine())).detail


def test_a_doubled_speed_does_not_become_a_result() -> None:
    raw = _miscounted(RECORDS[1], 2)
    found = analyse(raw, machine())
    assert found.rundown is None
    assert found.speed_hz.size == 0
    with pytest.raises(InputError, match="is twice the 96"):
        measured_drop(raw, machine())


def test_what_is_left_when_a_wrong_unit_goes_is_judged_too() -> None:
    raw = _miscounted(RECORDS[2], 2)
    raw["speed"] = raw["speed"].copy(data=30 * raw["speed"].values)
    told = [found.detail for found in check(assign(raw, machine()), machine()) if found.check == "speed"]
    assert "rpm written as Hz" in told[0] or "a wrong unit" in told[0]
    assert "from the keyphasor at the start" in told[1] and "is twice" in told[1]
    assert analyse(raw, machine()).speed_hz.size == 0


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem)
def test_a_keyphasor_alone_is_borne_out_by_the_shaft(path: Path) -> None:
    found = _speed_check(assign(read(path).drop_vars("speed"), machine()))
    assert found.passed
    assert found.channel == "keyphasor"
    assert "the spectrum of the levitated shaft has a line there" in found.detail


def _judged(orders: Mapping[float, float], stated: float, turning: float = 80.0, only: str = "") -> Miscounted | None:
    """Judge a speed on a shaft that draws lines of so many um at multiples of its turning (in one probe alone, if named)."""
    noise = np.random.default_rng(5)
    time = np.arange(int(0.12 * RATE)) / RATE
    channels = {}
    for k, name in enumerate(PROBES):
        drawn = {o: a for o, a in orders.items() if only in ("", name) or o in (1.0, 2.0)}
        shaft = sum(a * np.sin(2 * np.pi * o * turning * time + k * np.pi / 2) for o, a in drawn.items())
        fall = -0.5 * 9.81e6 * np.maximum(time - 0.1, 0) ** 2 * 2
        hum = 0.3 * np.sin(2 * np.pi * 50 * time)
        channels[name] = ("time", 1e-6 * (shaft + fall + hum + 0.1 * noise.standard_normal(time.size)))
    lines = levitated_lines(xr.Dataset(channels, coords={"time": time}), machine())
    assert lines is not None
    return miscounted(lines, stated, 50.0)


def test_an_elliptical_surface_is_no_doubled_speed() -> None:
    assert _judged({1: 0.5, 2: 5.0}, 80.0) is None  # twice per revolution ten times as wide
    assert _judged({1: 0.5, 2: 5.0, 3: 0.5}, 80.0) is None
    assert _judged({1: 2.0, 2: 1.0, 3: 6.0}, 80.0) is None


def test_a_doubled_speed_on_an_elliptical_surface_is_found() -> None:
    """Once per revolution stands at half the stated speed, though weaker; three times per revolution makes it sure."""
    sure = _judged({1: 1.0, 2: 5.0, 3: 0.6}, 160.0)
    assert sure is not None and sure.sure
    assert (sure.times, sure.hz) == (2.0, 80.0)
    doubtful = _judged({1: 3.0, 2: 5.0}, 160.0)
    assert doubtful is not None and not doubtful.sure
    assert doubtful.times == 2.0


def test_every_other_pulse_missed_is_doubted_where_once_per_revolution_does_not_show() -> None:
    halved = _judged({1: 5.0, 2: 1.0}, 40.0)
    assert halved is not None and not halved.sure
    assert (halved.times, halved.hz) == (0.5, 80.0)


def test_what_one_probe_or_the_mains_shows_is_not_the_shaft() -> None:
    assert _judged({1: 2.0, 2: 1.0, 0.5: 6.0}, 80.0, only="DE_B") is None
    assert _judged({1: 2.0, 0.5: 5.0}, 100.0, turning=100.0) is None  # 50 Hz
    assert _judged({1: 2.0, 2: 1.0, 50 / 97: 5.0}, 97.0, turning=97.0) is None  # 50 Hz again, near half the speed


def test_a_strong_line_is_told_from_the_mains_near_it() -> None:
    found = _judged({1: 5.0, 2: 1.0}, 2 * 96.0, turning=96.0)  # 100 Hz is the mains' second harmonic
    assert found is not None and found.sure


def test_a_shaft_that_coasts_through_a_long_levitation_bears_its_speed_out() -> None:
    time = np.arange(int(1.1 * RATE)) / RATE
    hz = 200.0 * np.exp(-time / 14)
    turns = 200.0 * 14 * (1 - np.exp(-time / 14))
    fall = -0.5 * 9.81e6 * np.maximum(time - 1.0, 0) ** 2 * 2
    noise = np.random.default_rng(6)
    ds = xr.Dataset(coords={"time": time})
    for k, name in enumerate(PROBES):
        wave = 3 * np.sin(2 * np.pi * turns + k * np.pi / 2)
        ds[name] = ("time", 1e-6 * (wave + fall + 0.1 * noise.standard_normal(time.size)))
    ds["speed"] = ("time", hz)
    assert _speed_check(ds).detail.endswith("the spectrum of the levitated shaft has a line there")
    assert refuted(ds, machine()) == ()


def test_a_shaft_that_lies_already_says_nothing_of_the_speed() -> None:
    """At 5 s into a coast-down it swings at 28 Hz on its bearings, and turns at 62 Hz."""
    ds = assign(read(DATASETS / "coastdown" / "drop_100.nc").isel(time=slice(50_000, 60_000)), machine())
    assert levitated_lines(ds, machine()) is None
    assert not refuted(ds, machine())


def test_probes_that_show_one_value_say_nothing_of_the_speed() -> None:
    """Rounding drew a line at a third of the speed, which was told as three marks and left out."""
    raw = read(RECORDS[0])
    for name in PROBES:
        raw[name] = raw[name].copy(data=np.full(raw[name].shape, 12.5e-6))
    ds = assign(raw, machine())
    assert levitated_lines(ds, machine()) is None
    assert _speed_check(ds).passed
    assert not refuted(ds, machine())
    assert analyse(ds, machine()).lines == ()
