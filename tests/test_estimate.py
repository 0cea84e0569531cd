"""Estimates: SI inside, their own unit outside, and never a number without what it is worth."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.effect import catalogue
from tdbsim.units import scale

from tdbmon.estimate import OUTSIDE, Estimate


@given(st.floats(-1e3, 1e3), st.floats(1e-9, 10), st.sampled_from(sorted(OUTSIDE)))
def test_json_is_in_the_unit_outside(value, sigma, unit):
    q = Estimate.from_sigma(value, sigma, unit, "test").to_json()
    assert q["value"] == pytest.approx(value * OUTSIDE[unit])
    assert q["high"] - q["low"] == pytest.approx(2 * 1.96 * sigma * OUTSIDE[unit], rel=1e-6, abs=1e-9 * OUTSIDE[unit])
    assert q["unit"] == unit


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        (Estimate(250e-6, 248.1e-6, 252.4e-6, "um"), "250 um (248 to 252)"),
        (Estimate(0.00354, 0.00335, 0.00372, "s"), "0.00354 s (0.00335 to 0.00372)"),
        (Estimate(0.1, 0.09998, 0.10002, "s"), "0.100000 s (0.099980 to 0.100020)"),
        (Estimate(4.18e7, 3.75e7, 4.68e7, "N/m"), "42 MN/m (38 to 47)"),
        (Estimate(1.2e-6, 1.1e-6, 1.3e-6, "um", kind="0-pk"), "1.20 um 0-pk (1.10 to 1.30)"),
        (Estimate(1.3, 1.2, 1.4), "1.30 (1.20 to 1.40)"),
        (Estimate.missing("um", "no probe"), "not estimated (no probe)"),
    ],
)
def test_text_is_that_of_the_terminal(estimate, text):
    assert str(estimate) == text


def test_an_interval_ends_at_what_is_possible():
    cut = Estimate.from_sigma(3.5e-6, 3.9e-6, "um", "test", least=0.0)
    assert (cut.low, cut.high) == (0.0, pytest.approx(3.5e-6 + 1.96 * 3.9e-6))
    assert Estimate.from_sigma(3.5e-6, 1e-6, "um", "test", least=0.0).low == pytest.approx(1.54e-6)
    assert Estimate.from_sigma(-1.0, 1.0, "1", "test", least=0.0).low == -1.0  # holds its own value


def test_the_standard_deviation_is_that_of_the_interval():
    """An interval that leans to one side has the mean of both halves, one cut at nought the half that is whole."""
    assert Estimate.from_sigma(3e-6, 4e-6, "um", "test").sigma == pytest.approx(4e-6)
    assert Estimate.from_sigma(3e-6, 4e-6, "um", "test", least=0.0).sigma == pytest.approx(4e-6)
    assert Estimate(4.3e7, 3.6e7, 12e7, "N/m").sigma == pytest.approx(4.2e7 / 1.96)
    assert Estimate(4.3e7, unit="N/m").sigma is None and Estimate.missing("N/m", "no contact").sigma is None
    of_logarithm = Estimate(2.0, 2.0 * math.exp(-1.96 * 0.3), 2.0 * math.exp(1.96 * 0.3))
    assert of_logarithm.log_sigma == pytest.approx(0.3)
    assert Estimate(1.0, 0.0, 2.0).log_sigma is None


def test_an_error_that_all_records_share_is_in_the_interval_and_not_in_that_of_a_difference():
    seen = Estimate.from_sigma(2e-6, 0.5e-6, "um", "test", "0-pk", least=0.0)
    wide = seen.widened(2e-6, "the bend", least=0.0)
    assert (wide.value, wide.low, wide.high) == (2e-6, 0.0, pytest.approx(4.98e-6))
    assert wide.method == "test; interval: also the bend" and wide.shared == pytest.approx(2e-6)
    again = wide.widened(1e-6)
    assert again.apart == wide.apart == seen and again.shared == pytest.approx(3e-6)
    assert seen.apart is seen and seen.shared == 0.0 and seen.widened(0.0) is seen
    missing = Estimate.missing("um", "no probe")
    assert missing.widened(1e-6) is missing and missing.shared == 0.0


def test_what_is_missing_says_why_and_nothing_is_infinite():
    assert Estimate.missing("um", "no probe").to_json()["why"] == "no probe"
    with pytest.raises(ValueError, match="say why"):
        Estimate(None)
    with pytest.raises(ValueError, match="finite"):
        Estimate(math.nan)
    with pytest.raises(ValueError, match="OUTSIDE"):
        Estimate(1.0, unit="furlong")


@pytest.mark.parametrize("declared", catalogue(), ids=[each.identifier for each in catalogue()])
def test_the_unit_of_every_size_of_the_catalogue_is_an_outside_one(declared):
    for each in declared.parameters:
        if not each.choices:
            assert pytest.approx(1 / scale(each.unit, each.si)) == OUTSIDE[each.unit], each.name
