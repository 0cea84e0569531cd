"""Spectral lines of run-downs whose orders, constant lines, hum and noise are known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.stats import binom
from tdbsim.errors import InputError

from tdbmon.analysis import cfar
from tdbmon.analysis.line_names import Band
from tdbmon.analysis.lines import Line, find_lines
from tdbmon.analysis.spectrum import cosine_window, short_time_spectra
from tests.analysis.planes import planes_of

RATE, SECONDS, START, TAU = 1000.0, 20.0, 70.0, 12.0
TIME = np.arange(int(RATE * SECONDS)) / RATE
SPEED = START * np.exp(-TIME / TAU)
TURNED = 2 * np.pi * START * TAU * (1 - np.exp(-TIME / TAU))
NOISE = 1e-7  # standard deviation of a sample, m
SWINGS = (Band("swing 1", 27.0, 30.0, swing=True), Band("swing 2", 42.0, 46.0, swing=True))


def _coloured(rng: np.random.Generator, kind: str) -> np.ndarray:
    """Noise at two ends in x and y, shape (4, samples)."""
    spectrum = np.fft.rfft(rng.standard_normal((4, TIME.size)))
    f = np.maximum(np.fft.rfftfreq(TIME.size, 1 / RATE), 1.0)
    shape = {
        "white": np.ones_like(f),
        "drifting": 1 / f**2,
        "step in density": np.where(f < 120.0, 1.0, 0.01),
        "broad hump": 1 / np.abs(1 - (f / 150.0) ** 2 + 0.2j * f / 150.0),
    }[kind]
    return NOISE * np.fft.irfft(spectrum * shape, TIME.size)


def _planes(channels: np.ndarray) -> xr.Dataset:
    return planes_of(TIME, {"NDE": channels[:2].T, "DE": channels[2:].T})


def _find(channels: np.ndarray, sense: int = 1, expected: tuple[Band, ...] = ()) -> tuple[Line, ...]:
    return find_lines(_planes(channels), TIME, SPEED, sense, 50.0, expected)


def _white(seed: int) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal((4, TIME.size))


def _cos(hz: float, phase: float = 0.0) -> np.ndarray:
    return np.cos(2 * np.pi * hz * TIME + phase)


def _by_name(lines: tuple[Line, ...]) -> dict[str, Line]:
    assert len({line.name for line in lines}) == len(lines)
    return {line.name: line for line in lines}


@pytest.mark.parametrize("rate", [1e-2, 1e-3])
def test_a_cell_of_noise_alarms_no_more_often_than_stated(rate):
    noise = np.random.default_rng(2).standard_normal(4_000_000)
    power = np.abs(short_time_spectra(noise, np.arange(0, len(noise) - 999, 500), 1000, 480, "blackman-harris")) ** 2
    found, floor = cfar.detect(power, rate)
    looked = found[:, cfar.FIRST : -cfar.LAST]
    # one cell in a few is a local maximum, and the greater of two medians is taken: the rate stays below the stated one
    assert 0 < looked.mean() < rate
    weight = cosine_window("blackman-harris", 1000)
    assert np.nanmean(floor) == pytest.approx(4 * np.sum(weight**2) / weight.sum() ** 2, rel=0.1)


@pytest.mark.parametrize(("cells", "rate"), [(6, 1e-2), (24, 1e-3)])
def test_multiplier_is_that_of_independent_exponential_noise(cells, rate):
    independent = cells // 2
    noise = np.random.default_rng(4).exponential(size=(400_000, independent + 1))
    rank = np.sort(noise[:, 1:], axis=1)[:, (independent + 1) // 2 - 1]
    alarms = int(np.sum(noise[:, 0] > cfar.multiplier(cells, rate) * rank))
    low, high = binom.ppf([0.0005, 0.9995], len(noise), rate)
    assert low <= alarms <= high


@pytest.mark.parametrize("kind", ["white", "drifting", "step in density", "broad hump"])
def test_noise_alone_raises_one_alarm_in_a_hundred_records_at_most(kind):
    records = 40
    alarmed = sum(bool(_find(_coloured(np.random.default_rng(seed), kind))) for seed in range(records))
    assert alarmed <= binom.ppf(0.999, records, cfar.RECORD_RATE)


def test_hum_in_noise_is_mains_and_nothing_else():
    for seed in range(15):
        hum = 4e-8 * _cos(50.0, 0.2) + 3e-8 * _cos(150.0, 1.0)
        lines = _find(_white(seed) + hum * np.array([[1.0], [0.8], [0.5], [1.2]]))
        assert {line.kind for line in lines} == {"mains"}
        assert {"mains", "3 x mains"} == set(_by_name(lines))
        assert [line.name for line in lines if line.combined] == ["3 x mains"]
        assert all(
            line.frequency.low - 0.02 <= n <= line.frequency.high + 0.02
            for line, n in zip(lines, (50, 150), strict=True)
        )


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [2e-7, 1e-5])
def test_intervals_of_frequencies_hold_the_truth_in_95_of_100(amplitude):
    held: dict[str, list[bool]] = {"constant": [], "order": []}
    for seed in range(200):
        rng = np.random.default_rng(seed)
        hz, order = 135.0 + rng.uniform(0, 1), 3.2 + rng.uniform(0, 0.03)
        channels = _white(seed + 1000)
        channels[[1, 3]] += amplitude * np.exp(-TIME / 10.0) * np.cos(2 * np.pi * hz * TIME + rng.uniform(0, 6, (2, 1)))
        channels[[0, 2]] += amplitude * np.cos(order * TURNED + rng.uniform(0, 6, (2, 1)))
        for line in _find(channels):
            # an order is given at one speed, which its own value gives back
            truth = hz if line.kind == "constant" else line.frequency.value / line.order * order
            held[line.kind].append(line.frequency.low <= truth <= line.frequency.high)
    for kind, inside in held.items():
        assert len(inside) == 200, kind  # found every time, and nothing else
        assert 0.90 <= np.mean(inside) <= 0.99, kind


@pytest.mark.parametrize("sense", [1, -1])
def test_orders_constants_and_mains_are_told_apart_with_their_directions(sense):
    spin = sense * TURNED
    nde = 2e-6 * np.exp(1j * spin) + 8e-7 * np.exp(-2j * spin + 0.3j) + 4e-7 * np.cos(0.5 * TURNED)
    nde = nde + 1e-6j * _cos(211.3) * np.exp(-TIME / 20.0) + 3e-7j * _cos(50.0)
    de = 1e-6 * np.exp(1j * spin) + 5e-7 * np.exp(-2j * np.pi * sense * 134.6 * TIME)
    channels = _white(1) + np.array([nde.real, nde.imag, de.real, de.imag])
    lines = _by_name(_find(channels, sense))
    told = {name: (line.kind, line.direction, line.end) for name, line in lines.items()}
    assert told == {
        "1X": ("order", "forward", "both"),
        "2X": ("order", "backward", "NDE"),
        "1/2X": ("order", "both", "NDE"),
        "mains": ("mains", "both", "NDE"),
        "134.6 Hz": ("constant", "backward", "DE"),
        "211.3 Hz": ("constant", "both", "NDE"),
    }
    assert lines["1X"].order == 1.0 and lines["1/2X"].order == 0.5 and lines["mains"].order is None
    assert lines["1X"].amplitude.value == pytest.approx(2e-6, rel=0.05)
    assert lines["2X"].amplitude.value == pytest.approx(8e-7, rel=0.1)
    assert lines["mains"].amplitude.value == pytest.approx(3e-7, rel=0.1)
    assert lines["134.6 Hz"].amplitude.value == pytest.approx(5e-7, rel=0.1)
    # the first window holds the mean of a decaying line over half a second
    assert lines["211.3 Hz"].amplitude.value == pytest.approx(1e-6, rel=0.1)
    assert lines["1X"].amplitude.kind == "0-pk"


def test_time_span_of_a_line_that_comes_and_goes():
    channels = _white(2)
    channels[1] += np.where((TIME > 6.0) & (TIME < 15.0), 1e-6 * _cos(180.0), 0.0)
    (line,) = _find(channels)
    assert line.first_s == pytest.approx(6.0, abs=1.0)
    assert line.last_s == pytest.approx(15.0, abs=1.0)
    assert line.end == "NDE"


def test_a_mode_that_orders_sweep_is_constant_and_a_sideband_is_no_line():
    # 2X excites a mode at 105 Hz as it passes; 1X - 20 Hz and 1X + 20 Hz are neither order nor constant
    near = np.exp(-(((TIME - TAU * np.log(2 * START / 105.0)) / 4.0) ** 2))
    channels = _white(3)
    channels[[0, 2]] += 1e-6 * near * _cos(105.0)
    channels[[1, 3]] += 1e-6 * np.cos(TURNED) * _cos(20.0)
    lines = _find(channels)
    assert [(line.kind, line.name) for line in lines] == [("constant", "105 Hz")]


def _swinging(seconds_decay: float = 25.0) -> np.ndarray:
    """Two swings on an arc of radius c whose frequencies rise by a percent as they die: y = x^2 / 2 c."""
    c = 2.8e-4
    first, second = 9e-5 * np.exp(-TIME / seconds_decay), 6e-5 * np.exp(-TIME / seconds_decay)
    phases = [
        2 * np.pi / RATE * np.cumsum(hz * (1 - 0.01 * np.exp(-2 * TIME / seconds_decay))) for hz in (28.57, 44.43)
    ]
    nde = first * np.cos(phases[0]) + second * np.cos(phases[1] + 0.4)
    de = first * np.cos(phases[0]) - 0.8 * second * np.cos(phases[1] + 0.4)
    return np.array([nde, nde**2 / (2 * c), de, de**2 / (2 * c)])


@pytest.mark.parametrize("told", [True, False])
def test_what_two_swings_make_on_their_arc_is_named_after_them(told):
    expected = (*SWINGS, Band("bending 1", 80.0, 140.0)) if told else ()
    channels = _white(4) + _swinging()
    channels[[1, 3]] += 4e-7 * np.exp(-TIME / 30.0) * _cos(134.7)
    lines = _by_name(_find(channels, expected=expected))
    mode = "bending 1" if told else "134.7 Hz"
    swings = {"swing 1", "swing 2", "2 x swing 1", "2 x swing 2", "swing 1 + swing 2", "swing 2 - swing 1"}
    assert set(lines) == swings | {mode}
    assert {line.kind for line in lines.values()} == {"constant"}
    assert {name for name, line in lines.items() if line.combined} == swings - {"swing 1", "swing 2"}
    for name, hz in (("swing 1", 28.57), ("swing 2", 44.43), ("2 x swing 1", 57.14), ("swing 2 - swing 1", 15.86)):
        assert lines[name].frequency.value == pytest.approx(hz, rel=0.01)
    assert lines[mode].frequency.value == pytest.approx(134.7, abs=0.1)


def test_what_goes_round_or_up_and_down_in_the_band_of_a_swing_is_none():
    """A whirl right round the clearance at 28.6 Hz, and a floor that shakes at 44 Hz."""
    channels = _white(8)
    channels[[0, 2]] += 2.8e-4 * _cos(28.6)
    channels[[1, 3]] += 2.8e-4 * _cos(28.6, -np.pi / 2) + 5e-6 * _cos(44.0)
    lines = _by_name(_find(channels, expected=SWINGS))
    assert set(lines) == {"28.6 Hz", "44 Hz"}
    assert lines["28.6 Hz"].direction == "forward"


def test_expected_bands_name_and_do_not_find():
    bands = (Band("bending 1", 100.0, 170.0), Band("bending 2", 200.0, 260.0))
    assert _find(_white(5), expected=bands) == ()
    channels = _white(5)
    channels[1] += 1e-6 * _cos(120.0) + 3e-7 * _cos(160.5)
    lines = _by_name(_find(channels, expected=bands))
    assert set(lines) == {"bending 1", "160.5 Hz"}
    assert lines["bending 1"].frequency.value == pytest.approx(120.0, abs=0.02)


def test_a_mode_on_a_multiple_of_the_mains_that_rings_and_dies_is_not_mains():
    channels = _white(6)
    channels[1] += 2e-6 * np.exp(-TIME / 4.0) * _cos(100.05)
    (line,) = _find(channels)
    assert line.kind == "constant"


def test_an_end_without_orbit_and_a_speed_with_holes_are_no_hindrance():
    channels = _white(7)
    channels[:2] = np.nan
    channels[2] += 1e-6 * np.cos(TURNED)
    channels[3] += 1e-6 * np.sin(TURNED)
    speed = SPEED.copy()
    speed[::7] = np.nan
    (line,) = find_lines(_planes(channels), TIME, speed, 1, 50.0)
    assert (line.name, line.end, line.direction) == ("1X", "DE", "forward")


def test_a_shaft_at_rest_shows_constant_lines_after_a_run_down():
    speed = np.where(TIME < 12.0, 40.0 * (1 - TIME / 12.0), 0.0)
    channels = _white(8)
    channels[0] += 1e-6 * _cos(28.5)
    (line,) = find_lines(_planes(channels), TIME, speed, 1, 50.0)
    assert line.kind == "constant" and line.last_s > 18.0


def test_constant_speed_decides_nothing():
    channels = _white(9)
    channels[0] += 1e-6 * _cos(60.0) + 1e-6 * _cos(95.0)
    assert find_lines(_planes(channels), TIME, np.full_like(TIME, 60.0), 1, 50.0) == ()


def test_half_a_second_gives_few_lines_or_none():
    short = TIME[:500]
    tone = 1e-5 * np.cos(TURNED[:500]) + 1e-5 * _cos(28.5)[:500]
    planes = planes_of(short, {"NDE": np.column_stack([tone, tone]), "DE": np.column_stack([tone, tone])})
    lines = find_lines(planes, short, SPEED[:500], 1, 50.0)
    assert all(line.kind == "order" and line.order == 1.0 for line in lines)
    tiny = planes.isel(time=slice(0, 20))
    assert find_lines(tiny, short[:20], SPEED[:20], 1, 50.0) == ()


def test_speed_is_needed():
    planes = _planes(_white(10))
    assert find_lines(planes, np.empty(0), np.empty(0), 1, 50.0) == ()
    assert find_lines(planes, TIME + 1000.0, SPEED, 1, 50.0) == ()
    with pytest.raises(InputError, match="give one value per time"):
        find_lines(planes, TIME, SPEED[:-1], 1, 50.0)
