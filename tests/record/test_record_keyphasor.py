"""Keyphasor pulses against shaft angles known in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import example, given, settings
from hypothesis import strategies as st
from record_machine import machine
from tdbsim.errors import InputError

from tdbmon.record.assign import assign
from tdbmon.record.keyphasor import Pulses, pulses, shaft_angle, speed
from tdbmon.record.read import read

DATASETS = Path(__file__).parents[2] / "datasets"
RATE = 10_000.0
DECAY = 14.0


def _turns(time: np.ndarray, hz: float) -> np.ndarray:
    """Return revolutions of a shaft whose speed decays exponentially; the first mark passes within a revolution."""
    return hz * DECAY * (1 - np.exp(-time / DECAY)) - 0.25


def _record(signal: np.ndarray, time: np.ndarray) -> xr.Dataset:
    ds = xr.Dataset({"keyphasor": ("time", signal)}, coords={"time": time})
    ds.attrs["source_file"] = "drop.nc"
    return ds


def _digital(hz: float, seconds: float, width: float = 0.03) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(int(seconds * RATE)) / RATE
    return time, (_turns(time, hz) % 1.0 < width).astype(float)


def _true_pulses(hz: float, seconds: float) -> np.ndarray:
    count = int(np.floor(_turns(np.array(seconds - 1 / RATE), hz)))
    return -DECAY * np.log(1 - (np.arange(count + 1) + 0.25) / (hz * DECAY))


@settings(deadline=None, max_examples=25)
@given(st.floats(20, 300), st.floats(1.0, 4.0))
def test_digital_pulses_are_found_within_half_a_sample(hz: float, seconds: float) -> None:
    time, signal = _digital(hz, seconds, 0.1)
    found = pulses(_record(signal, time), machine())
    truth = _true_pulses(hz, seconds)
    assert (found.missed, found.extra) == (0, 0)
    assert abs(found.times.size - truth.size) <= 1  # the last one may lie within the last interval
    n = min(found.times.size, truth.size)
    assert np.abs(found.times[:n] - truth[:n]).max() <= 0.5001 / RATE
    assert found.sigma == pytest.approx(1 / RATE / np.sqrt(12))


def test_the_stated_scatter_of_speed_is_the_true_one() -> None:
    time, signal = _digital(147.3, 20.0, 0.1)
    at, hz, sigma = speed(pulses(_record(signal, time), machine()))
    truth = 147.3 * np.exp(-at / DECAY)
    normalised = (hz - truth) / sigma
    assert np.mean(normalised) == pytest.approx(0.0, abs=0.1)
    assert np.std(normalised) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("edge", ["rising", "falling"])
@pytest.mark.parametrize("polarity", [1.0, -1.0])
def test_analogue_pulses_are_found_below_the_sample(edge: str, polarity: float) -> None:
    hz, seconds = 80.0, 3.0
    time = np.arange(int(seconds * RATE)) / RATE
    phase = (_turns(time, hz) + 0.5) % 1.0 - 0.5
    # ramps of 5 % of a revolution about the edges at -/+ a tenth of a revolution
    level = np.clip(0.5 - (np.abs(phase) - 0.1) / 0.05, 0, 1)
    signal = polarity * (5.0 * level - 12.0) + np.random.default_rng(3).normal(0, 0.01, time.size)
    found = pulses(_record(signal, time), machine(keyphasor={"channel": "keyphasor", "edge": edge}))
    at = _turns(found.times, hz) % 1.0
    expected = 0.9 if (edge == "rising") == (polarity > 0) else 0.1
    errors = (at - expected) / (hz * np.exp(-found.times / DECAY))
    # noise over slope; a straight line between two samples takes shares s and 1 - s of theirs: 2/3 of the variance
    predicted = 0.01 / (5.0 / (0.05 / hz)) * np.sqrt(2 / 3)
    assert np.std(errors) == pytest.approx(predicted, rel=0.2)
    assert np.abs(np.mean(errors)) < predicted / 2
    assert found.sigma == pytest.approx(predicted, rel=0.35)


def test_the_shaft_angle_is_continuous_and_right() -> None:
    time, signal = _digital(100.0, 30.0)
    there = machine(keyphasor={"channel": "keyphasor", "angle": "30 deg"})
    angle = shaft_angle(pulses(_record(signal, time), there), time, there)
    inside = np.isfinite(angle)
    truth = _true_pulses(100.0, 30.0)
    assert np.all(np.isnan(angle[time < truth[0] - 1 / RATE]))
    assert np.all(np.isnan(angle[time > truth[-1] + 1 / RATE]))
    assert np.all(np.diff(angle[inside]) > 0)
    error = angle[inside] - (np.radians(30.0) + 2 * np.pi * _turns(time[inside], 100.0))
    assert np.abs(error).max() < 2 * np.pi * 100.0 * 1.0 / RATE  # one sample at the highest speed


def test_a_clockwise_rotor_turns_backwards() -> None:
    time, signal = _digital(100.0, 1.0)
    there = machine(rotation="cw")
    angle = shaft_angle(pulses(_record(signal, time), there), time, there)
    assert np.all(np.diff(angle[np.isfinite(angle)]) < 0)


@settings(deadline=None, max_examples=25)
@given(st.sets(st.integers(3, 90), min_size=1, max_size=5))
@example({3, 5, 7})
@example({4, 5, 6, 30, 60})
def test_missed_pulses_are_counted_and_bridged(lost: set[int]) -> None:
    time, signal = _digital(100.0, 1.0, 0.05)
    whole = pulses(_record(signal, time), machine())
    turn = np.floor(_turns(time, 100.0)).astype(int)
    found = pulses(_record(np.where(np.isin(turn, list(lost)), 0.0, signal), time), machine())
    assert found.missed == len(lost)
    assert found.turns[-1] == whole.turns[-1]
    np.testing.assert_array_equal(np.isin(whole.times, found.times), ~np.isin(whole.turns, list(lost)))


@pytest.mark.parametrize("wheel", [1, 4])
def test_marks_missed_in_a_gap_of_time_are_told_apart(wheel: int) -> None:
    """Of a toothed wheel only one mark a revolution is kept: counted among those, a gap's marks were a faulty sensor's."""
    there = machine()
    there = there.model_copy(update={"keyphasor": there.keyphasor.model_copy(update={"pulses_per_revolution": wheel})})
    time = np.arange(int(RATE)) / RATE
    signal = ((wheel * _turns(time, 100.0)) % 1.0 < 0.2).astype(float)
    there_are = pulses(_record(signal, time), there)
    kept = (time < 0.4) | (time > 0.427)
    found = pulses(_record(signal[kept], time[kept]), there)
    assert found.in_holes == found.missed
    assert abs(found.missed - 2.65 * wheel) <= 1
    assert found.turns[-1] == there_are.turns[-1]


@settings(deadline=None, max_examples=25)
@given(
    st.lists(
        st.tuples(st.integers(3, 90), st.floats(0.12, 0.85)), min_size=1, max_size=4, unique_by=lambda x: x[0] // 4
    )
)
def test_surplus_pulses_are_dropped(added: list[tuple[int, float]]) -> None:
    time, signal = _digital(100.0, 1.0, 0.05)
    whole = pulses(_record(signal, time), machine())
    position = _turns(time, 100.0)
    for turn, share in added:
        signal = np.where(np.abs(position - turn - share) < 0.015, 1.0, signal)
    found = pulses(_record(signal, time), machine())
    assert found.extra == len(added)
    assert found.missed == 0
    np.testing.assert_array_equal(found.times, whole.times)


def test_a_missed_and_a_surplus_pulse_do_not_lose_the_angle() -> None:
    time = np.arange(int(5 * RATE)) / RATE
    position = 50.0 * time + 0.3025
    whole = pulses(_record((position % 1.0 < 0.05).astype(float), time), machine())
    signal = np.where(np.floor(position) == 100, 0.0, position % 1.0 < 0.05)
    found = pulses(_record(np.where(np.abs(position - 40.2) < 0.03, 1.0, signal), time), machine())
    assert (found.missed, found.extra) == (1, 1)
    assert found.turns[-1] == whole.turns[-1]
    np.testing.assert_allclose(speed(found)[1], 50.0, rtol=1e-9)


@pytest.mark.parametrize("lost", [{60, 62, 64}, {94}, {-2}, {-3, -2}])
def test_turns_are_counted_over_alternate_pulses_and_near_the_end(lost: set[int]) -> None:
    time, signal = _digital(100.0, 1.0, 0.05)
    whole = pulses(_record(signal, time), machine())
    turn = np.floor(_turns(time, 100.0)).astype(int)
    last = turn[np.searchsorted(time, whole.times[-1]) + 1]
    gone = [each if each >= 0 else last + 1 + each for each in lost]
    found = pulses(_record(np.where(np.isin(turn, gone), 0.0, signal), time), machine())
    assert (found.missed, found.turns[-1]) == (len(lost), whole.turns[-1])


@pytest.mark.parametrize("beyond", np.arange(0.02, 1.0, 0.07))
def test_the_last_turn_before_rest_may_be_long(beyond: float) -> None:
    """Dry friction: t of the turn that stops is 2.4 times that of the one before, with no pulse missed."""
    deceleration, speed = 2.0, 20.0
    stop = speed / deceleration
    rest = speed * stop / 2
    time = np.arange(int((stop + 1) * RATE)) / RATE
    position = rest - deceleration / 2 * np.maximum(stop - time, 0.0) ** 2 + 1 - beyond  # so much of a turn is left
    found = pulses(_record((position % 1.0 < 0.05).astype(float), time), machine())
    assert found.missed == 0
    np.testing.assert_array_equal(np.diff(found.turns), 1)


def test_a_whole_coastdown_to_rest() -> None:
    there = machine()
    ds = assign(read(DATASETS / "coastdown" / "drop_100.nc"), there)
    found = pulses(ds, there)
    assert (found.missed, found.extra) == (0, 0)
    at, hz, sigma = speed(found)
    assert np.all(np.diff(found.turns) == 1)
    measured = np.interp(at, ds["time"].values, ds["speed"].values)
    early = hz > 5.0  # there the speed hardly changes within a revolution
    noise = np.std(np.diff(ds["speed"].values[-1000:])) / np.sqrt(2)
    normalised = (hz - measured)[early] / np.hypot(sigma[early], noise)
    assert np.abs(np.mean(normalised)) < 0.2
    assert 0.7 < np.std(normalised) < 1.3


@pytest.mark.parametrize(
    "signal", [np.zeros(100), np.full(100, np.nan), np.empty(0), np.array([1.0]), np.r_[np.zeros(50), np.ones(50)]]
)
def test_signals_without_pulses_are_no_error(signal: np.ndarray) -> None:
    found = pulses(_record(signal, np.arange(signal.size) / RATE), machine())
    assert found.times.size <= 1
    assert "pulse" in found.quality
    assert all(part.size == 0 for part in speed(found))
    assert np.all(np.isnan(shaft_angle(found, np.arange(5) / RATE, machine())))


@pytest.mark.parametrize("edges", [2, 3])
def test_every_pulse_may_bounce(edges: int) -> None:
    time, signal = _digital(80.0, 1.0, 0.2)
    rises = np.flatnonzero(np.diff(signal) > 0) + 1
    for k in range(1, edges):
        signal[rises + 3 * k - 1] = 0.0  # falls back for a sample, 0.2 ms after the edge and again
    found = pulses(_record(signal, time), machine())
    truth = _true_pulses(80.0, 1.0)
    assert np.abs(found.times - truth[: found.times.size]).max() <= 0.5001 / RATE
    assert (found.missed, found.extra) == (0, (edges - 1) * len(truth))
    assert speed(found)[1] == pytest.approx(80.0, rel=0.08)


def test_hum_on_the_signal_swallows_no_pulse() -> None:
    time, signal = _digital(80.0, 1.0)
    noise = np.random.default_rng(4).normal(0, 0.02, time.size)
    found = pulses(_record(5 * (signal + 0.3 * np.sin(2 * np.pi * 50 * time) + noise), time), machine())
    assert (found.missed, found.extra) == (0, 0)
    assert np.abs(found.times - _true_pulses(80.0, 1.0)[: found.times.size]).max() <= 1 / RATE


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_has_no_pulses(seed: int) -> None:
    signal = np.random.default_rng(seed).normal(0, 0.01, 20_000)
    found = pulses(_record(signal, np.arange(20_000) / RATE), machine())
    assert found.times.size == 0
    assert found.quality == "no pulses: the signal is noise, without two levels"


def test_missing_samples_are_passed_over() -> None:
    time, signal = _digital(100.0, 1.0)
    holes = np.where(np.random.default_rng(1).random(time.size) < 0.01, np.nan, signal)
    found = pulses(_record(holes, time), machine())
    assert isinstance(found, Pulses)
    assert (found.missed, found.extra) == (0, 0)
    assert np.abs(found.times - pulses(_record(signal, time), machine()).times).max() < 2.5 / RATE


def test_of_a_toothed_wheel_one_pulse_a_revolution_is_kept() -> None:
    """Teeth whose pitch is off by 2 %, as that of machined ones is; the speed is that of the shaft, not of the teeth."""
    hz, seconds, teeth = 90.0, 5.0, 6
    time = np.arange(int(seconds * RATE)) / RATE
    turns = _turns(time, hz)
    off = 0.02 * np.random.default_rng(7).standard_normal(teeth)
    tooth = np.floor(turns * teeth).astype(int) % teeth
    signal = ((turns * teeth % 1.0 > 0.3 + off[tooth]) & (turns * teeth % 1.0 < 0.6 + off[tooth])).astype(float)
    wheel = machine(keyphasor={"channel": "keyphasor", "pulses_per_revolution": teeth})
    found = pulses(_record(signal, time), wheel)
    at, stated, sigma = speed(found)
    normalised = (stated - hz * np.exp(-at / DECAY)) / sigma
    assert found.times.size == pytest.approx(turns[-1], abs=2)
    assert np.mean(normalised) == pytest.approx(0.0, abs=0.1)
    assert np.std(normalised) == pytest.approx(1.0, abs=0.15)  # uneven teeth do not show
    assert "one of 6 per revolution" in found.quality


def test_no_keyphasor_is_told() -> None:
    ds = xr.Dataset({"NDE_A": ("time", np.zeros(5))}, coords={"time": np.arange(5.0)})
    with pytest.raises(InputError, match="no keyphasor"):
        pulses(ds, machine())


@pytest.mark.parametrize("spikes", [(6.0, 9.0), (-50.0, -75.0), (50.0, -90.0)])
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_spikes_far_above_the_pulses_do_not_hide_them(spikes: tuple[float, float], noise: float) -> None:
    """The trip itself may strike the channel: one spike six times as high as the pulses left one pulse of all."""
    time, signal = _digital(96.0, 0.5)
    signal += np.random.default_rng(1).normal(0, noise, time.size)
    clean = pulses(_record(signal, time), machine())
    signal[[1050, 3500]] = spikes
    found = pulses(_record(signal, time), machine())
    assert found.extra <= 2
    np.testing.assert_array_equal(found.turns, clean.turns)
    np.testing.assert_allclose(found.times, clean.times, atol=2e-6)


@pytest.mark.parametrize("pulsed", [[1000], [1000, 3000, 4500]])
def test_few_short_pulses_are_no_spikes(pulsed: list[int]) -> None:
    time = np.arange(5000) / RATE
    signal = np.random.default_rng(1).normal(0, 0.02, time.size)
    signal[pulsed] = 5.0
    assert pulses(_record(signal, time), machine()).times.size == len(pulsed)
