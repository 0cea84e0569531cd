"""What the viewer is given."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pytest

from tdbmon.analysis.result import Analysis
from tdbmon.figures.envelope import envelope, envelope_line
from tdbmon.report.signal import Signal, Signals, signals_of


def _decode(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<i2").astype(float)


def test_an_envelope_loses_no_peak_whatever_the_number_of_bins() -> None:
    values = np.random.default_rng(1).normal(size=10_007)
    for bins in (1, 7, 100, 10_007):
        low, high = envelope(values, bins)
        assert len(low) == len(high) == bins
        assert low.min() == values.min() and high.max() == values.max()
    low, high = envelope(values, len(values))
    assert np.array_equal(low, values) and np.array_equal(high, values)


def test_an_envelope_passes_over_missing_samples() -> None:
    values = np.array([1.0, np.nan, 3.0, np.nan, np.nan, np.nan, 2.0, 5.0, 4.0])
    low, high = envelope(values, 3)
    assert np.array_equal(low, [1.0, np.nan, 2.0], equal_nan=True)
    assert np.array_equal(high, [3.0, np.nan, 5.0], equal_nan=True)


def test_a_short_signal_is_drawn_sample_by_sample() -> None:
    time, values = np.arange(20) * 0.1, np.arange(20.0)
    assert envelope_line(time, values, 10)[1] is values
    thinned = envelope_line(time, values, 5)
    assert len(thinned[0]) == len(thinned[1]) == 10


@pytest.mark.parametrize("bins", [5, 500])
def test_a_line_is_broken_where_no_sample_was_taken(bins: int) -> None:
    """Drawn or thinned: across a hole in the time axis a straight line would be invented."""
    time = np.append(np.arange(100) * 0.1, 50 + np.arange(100) * 0.1)
    at, values = envelope_line(time, np.arange(200.0), bins)
    spans = np.flatnonzero(np.diff(at) > 20)
    assert len(spans) == 1 and np.isnan(values[spans]).all()
    assert np.nanmin(values) == 0.0 and np.nanmax(values) == 199.0
    assert np.nanmax(values[at < 20]) == 99.0 and np.nanmin(values[at > 40]) == 100.0


def _packed(values: np.ndarray, rate: float, spans: tuple[tuple[float, float], ...]) -> dict:
    time = np.arange(len(values)) / rate
    return Signals((Signal("a", "pane", "µm", time, values),), spans, (("fall", 1.0),)).packed()["channels"][0]


def test_levels_grow_finer_and_hold_the_extremes_of_what_they_span() -> None:
    rate, n = 10_000.0, 400_000
    time = np.arange(n) / rate
    values = 300 * np.sin(2 * np.pi * 30 * time) * np.exp(-time / 5)
    values[123_456] = 777.0
    channel = _packed(values, rate, ((0.95, 5.0), (0.95, 1.35)))
    levels = channel["levels"]
    assert [level["step"] for level in levels] == sorted((level["step"] for level in levels), reverse=True)
    assert len(levels) == 3 and levels[-1]["step"] == pytest.approx(1 / rate)
    for level in levels:
        inside = (time >= level["start"] - 1e-9) & (time < level["start"] + level["step"] * level["count"] - 1e-9)
        low = _decode(level["low"]) * channel["scale"] + channel["offset"]
        high = _decode(level["high"] or level["low"]) * channel["scale"] + channel["offset"]
        assert len(low) == len(high) == level["count"]
        assert low.min() == pytest.approx(values[inside].min(), abs=channel["scale"])
        assert high.max() == pytest.approx(values[inside].max(), abs=channel["scale"])


def test_the_finest_level_is_the_signal_itself_to_half_a_step_of_the_packing() -> None:
    values = np.random.default_rng(2).normal(size=3000)
    channel = _packed(values, 1000.0, ())
    (level,) = channel["levels"]
    assert level["high"] == ""
    shown = _decode(level["low"]) * channel["scale"] + channel["offset"]
    assert np.max(np.abs(shown - values)) <= 0.5001 * channel["scale"]


def _times(level: dict, number: np.ndarray) -> np.ndarray:
    """Where the viewer draws samples or bins, s."""
    middle = 0.5 if level["high"] else 0.0
    return level["start"] + (number + middle) * level["step"]


@pytest.mark.parametrize("n", [4_000, 400_000])
def test_what_follows_a_hole_in_the_time_axis_is_drawn_at_its_time(n: int) -> None:
    rate = 10_000.0
    time = np.arange(n) / rate
    seconds = time[-1]
    time[n // 4 :] += 0.5 * seconds  # the logger paused
    values = np.where(np.arange(n) == n // 2, 5.0, 0.0)
    level = Signals((Signal("a", "pane", "µm", time, values),), (), ()).packed()["channels"][0]["levels"][0]
    high = _decode(level["high"] or level["low"])
    assert _times(level, np.array(high.argmax())) == pytest.approx(time[n // 2], abs=level["step"])
    empty = _times(level, np.flatnonzero(high == -32768))
    assert np.ptp(empty) == pytest.approx(0.5 * seconds, rel=0.01)
    assert time[n // 4 - 1] < empty.min() and empty.max() < time[n // 4]


def test_the_speed_of_each_turn_is_drawn_at_its_time(coastdown: Analysis) -> None:
    """A rotor that slows from 100 Hz to 5 Hz: turns grow twentyfold in length."""
    decay = 12.0
    turn = -decay * np.log(1 - np.arange(0, 1140) / (100 * decay))
    turning = replace(
        coastdown, record=coastdown.record.drop_vars("speed"), speed_time=turn, speed_hz=100 * np.exp(-turn / decay)
    )
    signals = signals_of(turning)
    assert signals is not None
    channel = signals.packed()["channels"][-1]
    level = channel["levels"][0]
    hz = _decode(level["low"]) * channel["scale"] + channel["offset"]
    assert channel["name"] == "speed"
    np.testing.assert_allclose(hz, 100 * np.exp(-_times(level, np.arange(len(hz))) / decay), atol=0.1)


def test_a_sampled_speed_with_a_hole_is_drawn_sample_by_sample(coastdown: Analysis) -> None:
    """It is no speed of turns: nothing is drawn through the hole."""
    time, hz = coastdown.speed_time, coastdown.speed_hz
    there = (time < 3.0) | (time > 3.5)
    speed = coastdown.record["speed"].copy(deep=True)
    speed[~there] = np.nan
    holed = replace(coastdown, record=coastdown.record.assign(speed=speed), speed_time=time[there], speed_hz=hz[there])
    channel = signals_of(holed).channels[-1]
    assert channel.name == "speed"
    np.testing.assert_array_equal(channel.time, time[there])


def test_missing_samples_and_a_constant_signal_can_be_packed() -> None:
    values = np.full(2000, np.nan)
    assert set(_decode(_packed(values, 1000.0, ())["levels"][0]["low"])) == {-32768.0}
    values[:] = 4.0
    channel = _packed(values, 1000.0, ())
    shown = _decode(channel["levels"][0]["low"]) * channel["scale"] + channel["offset"]
    assert np.allclose(shown, 4.0)
