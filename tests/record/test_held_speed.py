"""A speed whose values stand for many samples is taken at its updates, which may be older than they look."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.machine import Machine, load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.record.assign import assign
from tdbmon.record.held_speed import HELD, updates
from tdbmon.record.read import read
from tdbmon.shipped import shipped


def machine_of(name: str) -> Machine:
    return load_machine(shipped(f"{name}/machine.toml"))


def holding(drop: xr.Dataset, hz: float, late: float = 0.0, without: str = "") -> xr.Dataset:
    """The record with a speed that is updated at a rate, to values that are so many holds old."""
    time, values = drop["time"].to_numpy(), drop["speed"].to_numpy()
    slots = np.floor(time * hz + 1e-9) / hz
    read_at = np.clip(np.searchsorted(time, slots - late / hz - 1e-9), 0, None)
    held = drop.assign(speed=(drop["speed"].dims, values[read_at], drop["speed"].attrs))
    return held.drop_vars(without) if without else held


@pytest.mark.parametrize("uneven", [0.0, 0.04])
@pytest.mark.parametrize("decimals", [12, 1])
def test_updates_are_found_though_clocks_differ_and_values_repeat(uneven: float, decimals: int) -> None:
    rng = np.random.default_rng(3)
    at = np.arange(37.3, 20_000, 100.37)
    at = np.ceil(at + uneven * 100 * rng.uniform(-1, 1, at.size)).astype(int)
    values = np.round(90 - 4e-4 * at + rng.normal(0, 0.03, at.size), decimals)
    signal = np.repeat(np.append(91.0, values), np.diff(np.concatenate([[0], at, [20_000]])))
    signal[5003:5010] = np.nan
    found, length = updates(signal)
    assert length == pytest.approx(100.37, rel=0.01)
    assert np.abs(found[:, None] - at).min(axis=0).max() <= (1 if decimals == 12 and not uneven else 10)
    assert len(found) == pytest.approx(len(at), abs=1)


def test_neither_noise_nor_a_converter_nor_rest_is_a_held_speed() -> None:
    rng, ramp = np.random.default_rng(1), 100 * np.exp(-np.arange(20_000) / 8000)
    assert updates(ramp + rng.normal(0, 0.01, ramp.size)) is None
    assert updates(np.round(ramp + rng.normal(0, 0.01, ramp.size), 1)) is None  # dithers at each of its steps
    assert updates(np.round(ramp, 1)) is None  # without noise: stretches that lengthen as the rotor slows
    for start in (
        100.03,
        100.23,
    ):  # as many samples a step as good as even: its samples tell it to a step, updates no better
        coast = start * np.exp(-np.arange(25_000) / 118e3)
        assert updates(np.round(coast, 1)) is None
    assert updates(np.repeat([100.0, 99.0], [100, 900])) is None
    assert updates(np.full(1000, 50.0)) is None
    assert updates(np.maximum(ramp - 20 + rng.normal(0, 0.01, ramp.size), 0.0)) is None


@pytest.mark.parametrize("late", [0.0, 0.9])
@pytest.mark.parametrize("without", ["", "keyphasor"])
def test_the_interval_of_a_held_speed_holds_how_old_it_may_be(late: float, without: str) -> None:
    """Each sample taken as a measurement of its own, the speed at the release was off by a hundred of its intervals."""
    drop, machine = read(shipped("years/drop_05.nc")), machine_of("years")
    true = analyse(drop, machine).rundown.initial
    found = analyse(holding(drop, 200.0, late, without), machine)
    initial = found.rundown.initial
    assert initial.low <= true.value <= initial.high
    assert initial.high - initial.low < 0.1
    assert "the possible age of a held speed value" in initial.method
    said = next(each for each in found.checks if each.check == "held values")
    assert "every value is held for 0.005 s" in said.detail
    assert said.passed


@pytest.mark.parametrize("hz", [1.0, 10.0])
def test_a_speed_told_too_seldom_before_the_release_is_not_estimated(hz: float) -> None:
    drop = holding(read(shipped("years/drop_05.nc")), hz, without="keyphasor")
    laid = assign(drop, machine_of("years"))
    assert laid["speed"].size == 3 * hz
    assert laid["speed"].attrs[HELD] == pytest.approx(1 / hz, rel=1e-3)
    run = analyse(drop, machine_of("years")).rundown
    if hz == 10.0:
        assert "1 value of the speed before the release; 6 are needed" in run.initial.why
    else:
        assert run is None  # three values


def test_times_of_a_held_coast_down_hold_its_age() -> None:
    drop, machine = read(shipped("coastdown/drop_100.nc")), machine_of("coastdown")
    true = analyse(drop, machine).rundown.coast_down.half
    held = analyse(holding(drop, 100.0, 1.0, "keyphasor"), machine).rundown.coast_down.half
    assert held.low <= true.value <= held.high
    assert held.high - held.low < 0.05
