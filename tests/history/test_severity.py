"""The velocity of the rotor's centre without dimension, against motions whose velocity is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.estimate import Estimate
from tdbmon.history.severity import severity

RATE, RELEASE, CLEARANCE, SPEED = 20000.0, 0.1, 250e-6, 50.0


def planes(x: np.ndarray, y: np.ndarray) -> xr.Dataset:
    time = np.arange(len(x)) / RATE
    return xr.Dataset(
        {"displacement": (("end", "axis", "time"), np.stack([x, y])[None])},
        coords={"end": ["NDE"], "axis": ["x", "y"], "time": time},
    )


def known(value: float, unit: str, sigma: float = 0.0) -> Estimate:
    return Estimate.from_sigma(value, sigma, unit, "given")


def found(x, y, **changes):
    clearance = changes.get("clearance", known(CLEARANCE, "um"))
    return severity(planes(x, y), "NDE", RELEASE, known(SPEED, "Hz"), clearance)


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
    lively[:1500] *= 5
    assert found(lively, y).rms.value == pytest.approx(found(x, y).rms.value, rel=1e-3)


def test_an_uncertain_clearance_makes_the_severity_uncertain():
    angle = 2 * np.pi * SPEED * np.arange(8000) / RATE
    x, y = CLEARANCE * np.cos(angle), CLEARANCE * np.sin(angle)
    result = found(x, y, clearance=known(CLEARANCE, "um", 0.1 * CLEARANCE))
    assert result.rms.high - result.rms.low == pytest.approx(2 * 1.96 * 0.1 * result.rms.value, rel=0.02)
    missing = found(x, y, clearance=Estimate.missing("um", "it does not settle"))
    assert missing.peak.why == "it does not settle"


def test_a_record_that_ends_too_early_is_told():
    with pytest.raises(InputError, match="needs 0.2 s"):
        found(np.zeros(5000), np.zeros(5000))
