"""Swings whose frequency moves: followed with their range, and nothing else taken for one."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.analysis.contract import analysis_json
from tdbmon.analysis.drifting_swings import DriftingSwing, drifting_swings, lacking_swings
from tdbmon.analysis.line_names import Band
from tdbmon.analysis.lines import find_lines, spectra_against_time
from tdbmon.report.document import Table
from tdbmon.report.sections import spectra
from tests.analysis.planes import planes_of
from tests.shipped_drops import analysed

RATE, SECONDS, NOISE = 5000.0, 4.0, 0.3e-6
TIME = np.arange(0, SECONDS, 1 / RATE)
SPEED = 120 - 4 * TIME
BANDS = (Band("swing 1", 24.0, 33.0, swing=True), Band("swing 2", 38.0, 52.0, swing=True))


def found_in(x: np.ndarray, speed: np.ndarray = SPEED, seed: int = 0) -> tuple[DriftingSwing, ...]:
    """What is found where x shows at NDE, half of it in antiphase at DE, and y nothing but noise."""
    rng = np.random.default_rng(seed)
    ends = {
        name: np.column_stack([share * x, np.zeros_like(x)]) + NOISE * rng.standard_normal((TIME.size, 2))
        for name, share in (("NDE", 1.0), ("DE", -0.5))
    }
    planes = planes_of(TIME, ends)
    lines = find_lines(planes, TIME, speed, 1, 50.0, BANDS)
    lacking = lacking_swings(BANDS, lines)
    return drifting_swings(spectra_against_time(planes, TIME, speed), list(ends), lacking, lines)


def tone(start: float, end: float) -> np.ndarray:
    """A frequency that goes from one to the other over the record."""
    return np.cos(2 * np.pi * np.cumsum(np.linspace(start, end, TIME.size)) / RATE)


def test_a_swing_that_climbs_is_followed_from_its_lowest_to_its_highest_frequency():
    (found,) = found_in(80e-6 * tone(42.0, 49.0) * np.exp(-TIME / 4))
    assert (found.name, found.end) == ("swing 2", "NDE")
    window = SECONDS / 4.5  # its frequency is a mean over one
    assert found.lowest.value == pytest.approx(42.0 + 7 * window / 2 / SECONDS, abs=0.5)
    assert found.highest.value == pytest.approx(49.0 - 7 * window / 2 / SECONDS, abs=0.5)
    assert "drifts" in found.lowest.why and found.lowest.low is None
    assert 55e-6 < found.amplitude.value < 80e-6
    assert found.first_s < 0.5 and found.last_s > SECONDS - 0.9


def test_a_swing_that_keeps_its_frequency_is_a_line():
    speed = 120 * np.exp(-TIME / 3)
    assert not found_in(80e-6 * tone(45.0, 45.0) + 60e-6 * tone(28.0, 28.0), speed)


@pytest.mark.parametrize("seed", range(5))
def test_noise_is_no_swing(seed: int):
    assert not found_in(np.zeros_like(TIME), seed=seed)


def test_once_per_revolution_that_crosses_a_band_is_no_swing():
    speed = np.linspace(60, 36, TIME.size)
    assert not found_in(20e-6 * tone(60.0, 36.0), speed)


def test_a_weak_tone_beside_strong_ones_is_no_swing():
    assert not found_in(100e-6 * tone(80.0, 80.0) + 1e-6 * tone(42.0, 49.0))


def test_shipped_drops_with_a_conical_swing_that_climbs_tell_it():
    """No line told it, though it is the second strongest of all that moves."""
    analysis = analysed("years/drop_01")
    assert "swing 2" not in {line.name for line in analysis.lines}
    (found,) = analysis.drifting
    assert found.name == "swing 2"
    assert found.highest.value > 1.1 * found.lowest.value and found.amplitude.value > 50e-6
    (told,) = analysis_json(analysis)["drifting_swings"]
    assert told["lowest_hz"]["value"] == found.lowest.value and told["lowest_hz"]["why"]
    section = spectra.section(analysis)
    (table,) = (b for b in section.blocks if isinstance(b, Table) and b.caption.startswith("Swings in the clearance"))
    assert table.rows[0].cells[:3] == ("swing 2 (conical)", "DE", "43.7 Hz to 49.5 Hz")


def test_the_shipped_coast_down_lists_its_swings_as_lines(coastdown):
    assert {"swing 1", "swing 2"} <= {line.name for line in coastdown.lines}
    assert coastdown.drifting == ()
