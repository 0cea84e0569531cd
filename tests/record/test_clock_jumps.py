"""A clock that jumps against a logger that pauses: holes of one length, told apart by whether the rotor slowed."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from record_machine import machine

from tdbmon.record.clock_jumps import without_clock_jumps

RATE, DECAY, HZ = 1000.0, 14.0, 100.0
TIME = np.arange(30_000) / RATE


def _record(time: np.ndarray, speed: np.ndarray | None, keyphasor: np.ndarray | None = None) -> xr.Dataset:
    channels = {"NDE_A": ("time", np.zeros(len(time)))}
    if speed is not None:
        channels["speed"] = ("time", speed)
    if keyphasor is not None:
        channels["keyphasor"] = ("time", keyphasor)
    return xr.Dataset(channels, coords={"time": time, "other": np.arange(100) / 10.0})


def _speed(seed: int) -> np.ndarray:
    """Exponential decay, with noise of 10 mHz whose neighbours are alike."""
    noise = np.convolve(np.random.default_rng(seed).normal(size=len(TIME) + 20), np.ones(20) / 20, "valid")[: len(TIME)]
    return HZ * np.exp(-TIME / DECAY) + 0.01 * noise * np.sqrt(20)


def _jumped(at: float, length: float) -> np.ndarray:
    return np.where(TIME >= at, TIME + length, TIME)


@pytest.mark.parametrize("length", [0.05, 0.5, 5.0, 50.0])
@pytest.mark.parametrize("at", [3.0, 12.0, 25.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_jump_is_taken_out_and_a_pause_is_left(at: float, length: float, seed: int) -> None:
    speed = _speed(seed)
    found, checks = without_clock_jumps(_record(_jumped(at, length), speed), machine())
    np.testing.assert_allclose(found.time, TIME, atol=1e-9)
    assert [check.passed for check in checks] == [False]
    assert f"jumps by {length:.4g} s" in checks[0].detail
    assert found.other.equals(_record(TIME, speed).other)
    stays = (TIME < at) | (TIME > at + length)
    paused = _record(TIME[stays], speed[stays])
    if stays[-1]:  # the logger went on before the record's end
        left, checks = without_clock_jumps(paused, machine())
        assert left.identical(paused) and not checks


def test_two_jumps_are_taken_out_one_by_one() -> None:
    time = np.where(TIME >= 20.0, _jumped(5.0, 2.0) + 0.7, _jumped(5.0, 2.0))
    found, checks = without_clock_jumps(_record(time, _speed(1)), machine())
    np.testing.assert_allclose(found.time, TIME, atol=1e-9)
    assert ["jumps by 2 s" in checks[0].detail, "jumps by 0.7 s" in checks[1].detail] == [True, True]


def test_pulses_tell_a_jump_where_there_is_no_speed_signal() -> None:
    turns = HZ * DECAY * (1 - np.exp(-TIME / DECAY))
    pulse = (turns % 1.0 < 0.3).astype(float)
    found, checks = without_clock_jumps(_record(_jumped(8.0, 3.0), None, pulse), machine())
    np.testing.assert_allclose(found.time, TIME, atol=1e-9)
    assert len(checks) == 1


def test_a_rotor_that_does_not_slow_tells_nothing_of_a_hole() -> None:
    for speed in (np.full(len(TIME), HZ), np.zeros(len(TIME))):
        record = _record(_jumped(8.0, 3.0), speed + 0.01 * np.random.default_rng(2).normal(size=len(TIME)))
        found, checks = without_clock_jumps(record, machine())
        assert found.identical(record) and not checks


@pytest.mark.parametrize("channels", [{}, {"speed": ("time", np.zeros(3))}])
def test_a_record_without_a_speed_or_with_too_short_a_one_is_left(channels: dict) -> None:
    record = xr.Dataset(channels, coords={"time": [0.0, 0.1, 5.0]})
    assert without_clock_jumps(record, machine())[0].identical(record)
