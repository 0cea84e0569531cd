"""Waterfall, cascade and full spectrum against tones and noise whose spectra are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from tdbsim.errors import InputError

from tdbmon.analysis.spectrum import cascade, cosine_window, full_spectrum, waterfall, window_gain
from tests.analysis.planes import planes_of

RATE = 4000.0
TIME = np.arange(20000) / RATE


def _tone(amplitude: float, hz: float, phase: float = 0.3) -> np.ndarray:
    return amplitude * np.cos(2 * np.pi * hz * TIME + phase)


def _planes(x: np.ndarray, y: np.ndarray) -> xr.Dataset:
    return planes_of(TIME, {"NDE": np.column_stack([x, y]), "DE": np.column_stack([2 * x, 0.5 * y])})


def test_a_tone_on_a_bin_reads_its_amplitude_whatever_stands_under_it():
    planes = _planes(_tone(3e-6, 120.0) - 3e-4, _tone(1e-6, 37.0) + 1e-4)
    spectra = waterfall(planes, window_s=1.0)
    amplitude = spectra.amplitude
    np.testing.assert_allclose(
        amplitude.sel(end="NDE", axis="x").sel(frequency=120.0, method="nearest"), 3e-6, rtol=1e-6
    )
    np.testing.assert_allclose(
        amplitude.sel(end="DE", axis="x").sel(frequency=120.0, method="nearest"), 6e-6, rtol=1e-6
    )
    np.testing.assert_allclose(
        amplitude.sel(end="NDE", axis="y").sel(frequency=37.0, method="nearest"), 1e-6, rtol=1e-6
    )
    assert float(amplitude.sel(axis="x").sel(frequency=200.0, method="nearest").max()) < 1e-12
    assert spectra.attrs["scale"] == "0-pk"


@given(
    hz=st.floats(50.0, 900.0),
    window=st.sampled_from(["hann", "blackman-harris"]),
    length=st.sampled_from([512, 1000, 2000]),
)
@settings(max_examples=60, deadline=None)
def test_window_gain_is_what_a_tone_between_bins_loses(hz, window, length):
    weight = cosine_window(window, length)
    place = hz * length / RATE
    near = round(place)
    tone = np.exp(2j * np.pi * place * np.arange(length) / length)
    measured = abs(np.sum(weight * tone * np.exp(-2j * np.pi * near * np.arange(length) / length))) / weight.sum()
    assert measured == pytest.approx(abs(float(window_gain(window, np.array(place - near)))), abs=2e-5)


def test_noise_reads_its_density_times_the_stated_bandwidth():
    # white noise of variance s^2 has a mean-square of s^2 / (rate / 2) a hertz; a reading is sqrt(2) times its rms
    noise = np.random.default_rng(5).standard_normal((2, 400_000)) * 1e-7
    time = np.arange(400_000) / RATE
    spectra = waterfall(planes_of(time, {"NDE": noise.T}), window_s=0.25, step_s=0.25)
    power = float((spectra.amplitude.sel(frequency=slice(50, 950)) ** 2).mean())
    expected = 2 * 1e-14 / (RATE / 2) * spectra.attrs["noise_bandwidth_hz"]
    assert power == pytest.approx(expected, rel=0.01)
    assert spectra.attrs["noise_bandwidth_bins"] == pytest.approx(1.5)
    assert spectra.attrs["coherent_gain"] == pytest.approx(0.5)


def test_windows_are_placed_at_their_middle():
    burst = np.where(np.abs(TIME - 2.0) < 0.05, _tone(1e-6, 200.0), 0.0)
    spectra = waterfall(_planes(burst, burst), window_s=0.2, step_s=0.05)
    line = spectra.amplitude.sel(end="NDE", axis="x").sel(frequency=200.0, method="nearest")
    assert float(line.time[int(np.argmax(line.to_numpy()))]) == pytest.approx(2.0, abs=1e-9)
    assert spectra.attrs["overlap"] == pytest.approx(0.75)


def test_the_first_second_gets_short_windows_by_itself():
    planes = _planes(_tone(1e-6, 120.0), _tone(1e-6, 120.0))
    short = waterfall(planes.sel(time=slice(0.1, 1.1)))
    assert short.attrs["window_s"] == pytest.approx(0.125, rel=0.01)
    assert float(short.time[0]) == pytest.approx(0.1 + 0.0625, abs=1e-3)
    assert short.sizes["time"] > 20
    long = planes_of(np.arange(50_000) / RATE, {"NDE": np.zeros((50_000, 2))})
    assert waterfall(long).attrs["window_s"] == pytest.approx(1.0)


def test_a_hole_in_time_takes_its_own_windows_and_moves_none():
    """0.3 s of 5 s: at the mean rate 200 Hz would read as 188 Hz, and the burst at 3.5 s would stand at 3.3 s."""
    burst = np.where(np.abs(TIME - 3.5) < 0.05, _tone(5e-6, 300.0), 0.0)
    planes = _planes(_tone(1e-6, 200.0) + burst, _tone(1e-6, 200.0))
    whole = waterfall(planes, window_s=0.2, step_s=0.05).amplitude
    paused = planes.isel(time=(TIME < 1.2) | (TIME >= 1.5))
    found = waterfall(paused, window_s=0.2, step_s=0.05).amplitude
    np.testing.assert_allclose(found.time, whole.time, atol=1e-9)
    clear = (whole.time < 1.1 + 1e-9) | (whole.time > 1.6 - 1e-9)
    assert np.isnan(found.where(~clear, drop=True)).all()
    np.testing.assert_allclose(found.where(clear, drop=True), whole.where(clear, drop=True), atol=1e-15)


def test_an_end_that_is_not_known_stays_unknown():
    planes = _planes(_tone(1e-6, 120.0), _tone(1e-6, 120.0))
    planes.displacement.loc[{"end": "DE"}] = np.nan
    planes.displacement.values[0, 0, 8000:8100] = np.nan
    spectra = waterfall(planes, window_s=0.5, step_s=0.5)
    assert np.isnan(spectra.amplitude.sel(end="DE")).all()
    lost = np.isnan(spectra.amplitude.sel(end="NDE", axis="x")).all(dim="frequency")
    assert lost.to_numpy().tolist() == [i == 4 for i in range(10)]


@pytest.mark.parametrize("sense", [1, -1])
def test_full_spectrum_splits_an_ellipse_into_its_two_circles(sense):
    # forward circle of 3 um at 80 Hz and backward circle of 1 um at 80 Hz; a backward circle at 140 Hz
    along = 2 * np.pi * TIME * sense
    z = 3e-6 * np.exp(80j * along) + 1e-6 * np.exp(-80j * along + 0.7j) + 2e-6 * np.exp(-140j * along)
    spectra = full_spectrum(_planes(z.real, z.imag).sel(end=["NDE"]), sense, window_s=1.0)
    np.testing.assert_allclose(spectra.forward.sel(frequency=80.0, method="nearest"), 3e-6, rtol=1e-6)
    np.testing.assert_allclose(spectra.backward.sel(frequency=80.0, method="nearest"), 1e-6, rtol=1e-6)
    np.testing.assert_allclose(spectra.backward.sel(frequency=140.0, method="nearest"), 2e-6, rtol=1e-6)
    assert float(spectra.forward.sel(frequency=140.0, method="nearest").max()) < 1e-12


def test_sum_of_the_circles_is_the_greater_half_axis_and_difference_the_smaller():
    tilt, a, b = np.deg2rad(25.0), 5e-6, 2e-6
    u, v = _tone(a, 60.0, 0.0), _tone(b, 60.0, -np.pi / 2)
    planes = _planes(u * np.cos(tilt) - v * np.sin(tilt), u * np.sin(tilt) + v * np.cos(tilt))
    spectra = full_spectrum(planes.sel(end=["NDE"]), 1, window_s=1.0).sel(frequency=60.0, method="nearest")
    np.testing.assert_allclose(spectra.forward + spectra.backward, a, rtol=1e-6)
    np.testing.assert_allclose(spectra.forward - spectra.backward, b, rtol=1e-6)


def test_cascade_puts_an_order_on_its_ray_and_a_constant_line_on_its_column():
    time = np.arange(160_000) / RATE
    speed = 90.0 - 2.0 * time  # 90 to 10 Hz in 40 s
    phase = 2 * np.pi * (90.0 * time - time**2)
    x = 1e-6 * np.cos(2 * phase) + 2e-6 * np.cos(2 * np.pi * 300 * time)
    rays = cascade(waterfall(planes_of(time, {"NDE": np.column_stack([x, x])})), time, speed, step_hz=4.0)
    assert rays.speed.to_numpy().tolist() == sorted(rays.speed.to_numpy().tolist())
    assert int(rays.spectra.sum()) == waterfall(planes_of(time, {"NDE": np.column_stack([x, x])})).sizes["time"]
    line = rays.amplitude.sel(end="NDE", axis="x")
    below = line.sel(frequency=slice(5, 250))
    peak = below.frequency.to_numpy()[np.argmax(below.transpose("speed", "frequency").to_numpy(), axis=1)]
    np.testing.assert_allclose(peak, 2 * rays.speed, atol=5.0)  # half a step of speed, twice, and a bin
    np.testing.assert_allclose(line.sel(frequency=300.0, method="nearest"), 2e-6, rtol=1e-3)


def test_cascade_averages_power():
    time = np.arange(16_000) / RATE
    x = np.where(time < 2.0, 1.0, 3.0) * 1e-6 * np.cos(2 * np.pi * 100 * time)
    spectra = waterfall(planes_of(time, {"NDE": np.column_stack([x, x])}), window_s=0.5, step_s=0.5)
    ray = cascade(spectra, time, np.full_like(time, 40.0), step_hz=1.0)
    line = ray.amplitude.sel(end="NDE", axis="x").sel(frequency=100.0, method="nearest")
    np.testing.assert_allclose(line, [np.sqrt(5.0) * 1e-6], rtol=1e-6)


def test_cascade_averages_the_windows_that_have_all_their_samples():
    time = np.arange(16_000) / RATE
    x = 1e-6 * np.cos(2 * np.pi * 100 * time)
    x[5_000:5_100] = np.nan
    spectra = waterfall(planes_of(time, {"NDE": np.column_stack([x, x])}), window_s=0.5, step_s=0.5)
    assert np.isnan(spectra.amplitude).any()
    speed = np.where(time < 2.0, 40.0, 20.0)
    ray = cascade(spectra, time, speed, step_hz=1.0).amplitude.sel(end="NDE", axis="x")
    whole = ray.sel(frequency=100.0, method="nearest").sel(speed=[20.0, 40.0], method="nearest")
    np.testing.assert_allclose(whole, 1e-6, rtol=1e-6)


def test_what_cannot_be_transformed_is_said():
    planes = _planes(_tone(1e-6, 50.0), _tone(1e-6, 50.0))
    with pytest.raises(InputError, match=r"a window of 9 s .* give 16 samples"):
        waterfall(planes, window_s=9.0)
    with pytest.raises(InputError, match=r"give 16 samples"):
        waterfall(planes, window_s=0.001)
    with pytest.raises(InputError, match="less than one sample"):
        waterfall(planes, step_s=1e-5)
    spectra = waterfall(planes)
    with pytest.raises(InputError, match="no speed is known"):
        cascade(spectra, np.array([100.0, 101.0]), np.array([10.0, 9.0]))
    with pytest.raises(InputError, match="positive"):
        cascade(spectra, TIME, np.full_like(TIME, 50.0), step_hz=0.0)
