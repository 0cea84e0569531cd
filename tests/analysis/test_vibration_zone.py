"""Zones of ISO 14839-2: their limits, and what an uncertain distance says of them."""

from __future__ import annotations

import pytest

from tdbmon.analysis.vibration_zone import share_of_clearance, zone
from tdbmon.estimate import Estimate

C_MIN = 250e-6


def told(value_um: float, half_um: float = 0.0) -> str:
    reach = Estimate(value_um * 1e-6, (value_um - half_um) * 1e-6, (value_um + half_um) * 1e-6, "um", "", kind="0-pk")
    return zone(share_of_clearance(reach, C_MIN))


@pytest.mark.parametrize(
    ("value_um", "expected"),
    [(0.0, "A"), (74.0, "A"), (76.0, "B"), (99.0, "B"), (101.0, "C"), (124.0, "C"), (126.0, "D"), (260.0, "D")],
)
def test_the_limits_are_three_four_and_five_tenths_of_the_clearance(value_um: float, expected: str):
    assert told(value_um) == expected


def test_an_interval_that_crosses_a_limit_names_both_zones():
    assert told(73.0, 5.0) == "A or B"
    assert told(112.0, 20.0) == "B or D"
    assert told(60.0, 5.0) == "A"


def test_an_unknown_distance_has_no_zone():
    share = share_of_clearance(Estimate.missing("um", "no circle"), C_MIN)
    assert share.why == "no circle"
    assert zone(share) == ""
