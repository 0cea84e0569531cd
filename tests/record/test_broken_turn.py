"""Samples that a logger lost, or wrote twice, without a trace in its times."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from record_machine import machine

from tdbmon.record.broken_turn import broken_turn_checks, broken_turns
from tdbmon.record.keyphasor import Pulses, pulses

RATE, DECAY = 20_000.0, 12.0


def _pulses(kept: np.ndarray, time: np.ndarray, hz: float = 96.0) -> Pulses:
    """Return the pulses of a rotor that slows, of which the samples `kept` were written at the times `time`."""
    true = np.arange(kept.max() + 1) / RATE
    signal = (hz * DECAY * (1 - np.exp(-true / DECAY)) % 1.0 < 0.03).astype(float)[kept]
    return pulses(xr.Dataset({"keyphasor": ("time", signal)}, coords={"time": time}), machine())


@pytest.mark.parametrize(("gone", "words"), [(100, "5 ms shorter"), (10, "0.5"), (-100, "ms longer")])
def test_lost_and_doubled_samples_are_told_by_the_turn_that_they_are_in(gone: int, words: str) -> None:
    kept = np.concatenate([np.arange(4000), np.arange(4000 + gone, 10_000)])
    time = np.arange(kept.size) / RATE
    marks = _pulses(kept, time)
    (check,) = broken_turn_checks(marks, time)
    assert (check.check, check.passed) == ("lost samples", False)
    assert words in check.detail
    ((at, lost),) = broken_turns(marks, time)
    assert 0.18 < at < 0.2
    assert lost == pytest.approx(gone / RATE, abs=1.5 / RATE)


@pytest.mark.parametrize("hz", [20.0, 96.0, 480.0])
def test_a_shaft_that_slows_breaks_no_turn(hz: float) -> None:
    kept = np.arange(10_000)
    assert broken_turns(_pulses(kept, kept / RATE, hz), kept / RATE) == []


def test_a_hole_in_the_times_is_no_lost_sample() -> None:
    kept = np.concatenate([np.arange(4000), np.arange(4100, 10_000)])
    assert broken_turns(_pulses(kept, kept / RATE), kept / RATE) == []


def test_a_shaft_that_comes_to_rest_breaks_no_turn() -> None:
    turns = np.arange(40.0)
    times = 10.0 - np.sqrt(100.0 - turns * 100.0 / 39.5)  # a constant drag stops it half a turn after the last pulse
    marks = Pulses(times, turns.astype(int), 1e-5, 0, 0, 0, "")
    assert broken_turns(marks, np.arange(0, 10, 1e-4)) == []
