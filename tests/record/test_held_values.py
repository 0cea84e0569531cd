"""Probes that were sampled more slowly than the table that holds them are read at their own rate."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.machine import Machine, load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.record.assign import assign
from tdbmon.record.held_values import held
from tdbmon.record.quality import check
from tdbmon.record.read import read
from tdbmon.shipped import shipped


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(shipped("short/machine.toml"))


@pytest.fixture(scope="module")
def drop() -> xr.Dataset:
    return read(shipped("short/drop_100.nc"))


def holding(drop: xr.Dataset, names: list[str], times: int, first: int = 0) -> xr.Dataset:
    """The record with each value of some channels standing so many samples, from a sample on."""
    out = drop.copy()
    for name in names:
        values = drop[name].to_numpy().copy()
        slots = first + (np.arange(values.size) - first) // times * times
        out[name] = (drop[name].dims, values[np.clip(slots, 0, None)], drop[name].attrs)
    return out


@pytest.mark.parametrize(("times", "first"), [(2, 0), (5, 3), (10, 1)])
def test_a_drop_with_held_values_is_that_of_the_slower_rate(times, first, machine, drop):
    names = [probe.name for probe in machine.probes]
    found = analyse(holding(drop, names, times, first), machine)
    slower = drop.isel(time=slice(first, None, times))
    for name in names:
        assert np.array_equal(found.record[name].to_numpy()[-1000:], slower[name].to_numpy()[-1000:])
    assert not [each for each in found.checks if not each.passed]
    said = [each for each in found.checks if each.check == "held values"]
    assert [each.channel for each in said] == names
    assert f"every value is held for {times} samples: one is used, at {20000 / times:g} Hz" in said[0].detail
    sound = analyse(drop, machine).release.time
    assert found.release.time.low <= sound.value <= found.release.time.high


def test_what_is_not_held_stays_as_it_is(machine, drop):
    laid = assign(drop, machine)
    assert not [each for each in check(laid, machine) if each.check == "held values"]
    for name in (probe.name for probe in machine.probes):
        assert np.array_equal(laid[name].to_numpy(), drop[name].to_numpy(), equal_nan=True)


def test_steps_of_a_converter_and_frozen_stretches_are_not_held_values():
    rng = np.random.default_rng(1)
    slow = np.cumsum(rng.standard_normal(20000)) * 0.02
    assert held(np.round(slow))[1] == 1  # long stretches of one value, of any length
    busy = rng.standard_normal(20000)
    busy[3000:9000] = busy[3000]
    assert held(busy)[1] == 1
    assert held(np.zeros(20000))[1] == 1


def test_missing_samples_do_not_hide_that_values_are_held():
    values = np.repeat(np.random.default_rng(2).standard_normal(4000), 5)
    values[1003:1742] = np.nan
    assert held(values) == (0, 5)
