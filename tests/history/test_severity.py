"""The velocity of the rotor's centre without dimension, against motions whose velocity is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.estimate import Estimate
from tdbmon.history.severity import severity
from tdbmon.record.timebase import usual_rate

RATE, RELEASE, CLEARANCE, SPEED = 20000.0, 0.1, 250e-6, 50.0


def planes(x: np.ndarray, y: np.ndarray, time: np.ndarray) -> xr.Dataset:
    return xr.Dataset(
        {"displacement": (("end", "axis", "time"), np.stack([x, y])[None])},
        coords={"end": ["NDE"], "axis": ["x", "y"], "time": time},
        attrs={"sampling_hz": usual_rate(time)},
    )


def known(value: float, unit: str, sigma: float = 0.0) -> Estimate:
    return Estimate.from_sigma(value, sigma, unit, "given")


def found(x, y, **changes):
    clearance = changes.get("clearance", known(CLEARANCE, "um"))
    where = planes(x, y, changes.get("time", np.arange(len(x)) / changes.get("rate", RATE)))
    return severity(where, "NDE", changes.get("release", RELEASE), known(SPEED, "Hz"), clearance)


def test_whirl_round_the_clearance_with_the_rotation_is_one():
    angle = 2 * np.pi * SPEED * np.arange(8000) / RATE
    result = found(CLEARANCE * np.cos(angle), CLEARANCE * np.sin(angle))
    assert result.peak.value == pytest.approx(1.0, rel=0.01)
    assert result.rms.value == pytest.approx(1.0, rel=0.01)


def test_free_fall_through_the_clearance():
    g = 9.81
    after = np.maximum(0, np.arange(8000) / RATE - RELEASE)
    fall = np.sqrt(2 * CLEARANCE / g)
    y = np.where(after < fall, -0.5 * g * after**2, -CLEARANCE)
    result = found(np.zeros(8000), y)
    expected = np.sqrt(2 * g * CLEARANCE) / (2 * np.pi * SPEED * CLEARANCE)
    # the low-pass rounds the abrupt stop: a tenth is what it takes
    assert result.peak.value == pytest.approx(expected, rel=0.1)
    assert result.rms.value < 0.3 * expected


def test_where_the_shaft_lies_does_not_matter_and_what_was_before_the_release_neither():
    angle = 2 * np.pi * 30 * np.arange(8000) / RATE
    x, y = 1e-4 * np.cos(angle), 1e-4 * np.sin(angle)
    moved = found(x + 3e-4, y - 2e-4)
    assert moved.rms.value == pytest.approx(found(x, y).rms.value, rel=1e-6)
    lively = x.copy()
    lively[:1500] += 4e-4 * np.cos(angle[:1500]) * np.hanning(1500)
    assert found(lively, y).rms.value == pytest.approx(found(x, y).rms.value, rel=1e-3)


def test_an_uncertain_clearance_makes_the_severity_uncertain():
    angle = 2 * np.pi * SPEED * np.arange(8000) / RATE
    x, y = CLEARANCE * np.cos(angle), CLEARANCE * np.sin(angle)
    result = found(x, y, clearance=known(CLEARANCE, "um", 0.1 * CLEARANCE))
    assert result.rms.high - result.rms.low == pytest.approx(2 * 1.96 * 0.1 * result.rms.value, rel=0.02)
    missing = found(x, y, clearance=Estimate.missing("um", "it does not settle"))
    assert missing.peak.why == "it does not settle"


def orbit(rate: float, flat: float, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """An orbit of 0.8 times the clearance, as much flatter as is said, with white noise."""
    rng, count = np.random.default_rng(seed), int(0.31 * rate)
    angle = 2 * np.pi * SPEED * np.arange(count) / rate
    x, y = 0.8 * CLEARANCE * np.cos(angle), 0.8 * flat * CLEARANCE * np.sin(angle)
    return x + noise * rng.standard_normal(count), y + noise * rng.standard_normal(count)


@pytest.mark.parametrize("flat", [0.5, 1.0])
@pytest.mark.parametrize("rate", [5e3, 20e3, 100e3])
@pytest.mark.parametrize("noise", [0.25e-6, 2e-6])
def test_the_intervals_hold_the_truth_under_noise(rate, flat, noise):
    """Twenty peaks of one height, or a whirl that is all peak: the greatest of them is greater than the true one."""
    runs = 40
    results = [found(*orbit(rate, flat, noise, seed), rate=rate) for seed in range(runs)]
    peak, rms = 0.8, 0.8 * np.sqrt((1 + flat**2) / 2)
    assert sum(r.peak.low <= peak <= r.peak.high for r in results) >= 0.9 * runs
    assert sum(r.rms.low <= rms <= r.rms.high for r in results) >= 0.9 * runs
    # the noise that the levitated shaft shows is that of the plain integral of its spectrum: Butterworth's, there and back
    cubed = (2 * np.pi) ** 2 * 1000.0**3 * np.pi / (8 * np.sqrt(2))
    sigma = np.sqrt(2 * noise**2 / rate * cubed) / (2 * np.pi * SPEED * CLEARANCE)
    widths = np.median([(r.peak.high - r.peak.low, r.rms.high - r.rms.low) for r in results], axis=0)
    assert widths[0] < 8 * sigma
    assert widths[1] < 2 * 1.96 * sigma / np.sqrt(2 * 1000 * 0.2) * 1.4
    assert np.mean([r.rms.value for r in results]) == pytest.approx(rms, abs=0.1 * sigma)


def test_the_velocity_hardly_depends_on_the_sampling():
    """A blow of half a millisecond; central differences of samples at 5 kHz would make it 6 % softer."""
    peaks = []
    for rate in (5e3, 10e3, 100e3):
        time = np.arange(int(0.31 * rate)) / rate
        peaks.append(found(np.zeros(len(time)), 5e-6 * np.exp(-(((time - 0.2) / 5e-4) ** 2)), rate=rate).peak.value)
    assert peaks[:2] == pytest.approx([peaks[2]] * 2, rel=0.03)


def test_without_levitation_the_severity_has_no_interval():
    result = found(*orbit(RATE, 0.5, 1e-6, 0), release=0.005)
    assert result.peak.value == pytest.approx(0.8, rel=0.1)
    assert result.peak.low is None and "levitated" in result.peak.why


def test_missing_samples_are_told():
    x, y = orbit(RATE, 0.5, 0.0, 0)
    x[3000] = np.nan
    with pytest.raises(InputError, match="missing"):
        found(x, y)


@pytest.mark.parametrize("begins", [0.05, 0.2])
def test_a_hole_in_the_time_axis_is_told(begins):
    """Joined across it, the orbit jumps by 5 ms of its way within one sample."""
    x, y = orbit(RATE, 0.5, 0.0, 0)
    time = np.arange(len(x)) / RATE
    there = (time < begins) | (time > begins + 5e-3)
    with pytest.raises(InputError, match=r"no samples for 0.005\d* s after"):
        found(x[there], y[there], time=time[there])


def test_rounded_stamps_do_not_change_the_velocity():
    """Of stamps in steps of 10 us at 12.8 kHz, 78.125 us apart, the median interval is 80 us."""
    time = np.arange(int(0.31 * 12800)) / 12800
    angle = 2 * np.pi * SPEED * time
    result = found(CLEARANCE * np.cos(angle), CLEARANCE * np.sin(angle), time=np.round(time, 5))
    assert result.peak.value == pytest.approx(1.0, rel=0.01)
    assert result.rms.value == pytest.approx(1.0, rel=0.01)


def test_a_record_that_ends_too_early_is_told():
    with pytest.raises(InputError, match="needs 0.2 s"):
        found(np.zeros(5000), np.zeros(5000))


def test_of_a_shaft_that_stands_there_is_none():
    time = np.arange(0, 0.4, 1e-4)
    still = planes(np.zeros_like(time), np.zeros_like(time), time)
    for speed in (0.0, 0.015):
        of_it = severity(still, "NDE", RELEASE, known(speed, "Hz", 0.002), known(CLEARANCE, "um"))
        assert not of_it.peak.known
        assert "standstill at the release" in of_it.rms.why
