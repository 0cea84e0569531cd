"""How quantities are written."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from pathlib import Path

import pytest
import tdbsim
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.quantity import Tolerant

import tdbmon
from tdbmon.estimate import Estimate, since
from tdbmon.quantity import (
    moment,
    number,
    off_by,
    percent,
    plain,
    printed,
    rpm,
    short,
    subtracted,
    toleranced,
    why_no_interval,
    words,
)
from tdbmon.record.finding import um


def test_a_value_has_the_digits_that_its_interval_bears() -> None:
    assert words(Estimate(282.13e-6, 279.04e-6, 285.22e-6, "um")) == "282 µm (279 to 285)"
    assert words(Estimate(282.13e-6, 281.04e-6, 283.22e-6, "um")) == "282.1 µm (281.0 to 283.2)"
    assert words(Estimate(95.0095, 95.0081, 95.0109, "Hz")) == "95.0095 Hz (95.0081 to 95.0109)"


def test_why_there_is_no_interval_stands_behind_a_value_that_has_none() -> None:
    assert why_no_interval(Estimate(0.2, unit="s", why="in 3 of 32 simulations it takes longer")) == (
        " (in 3 of 32 simulations it takes longer)"
    )
    assert why_no_interval(Estimate(0.2, 0.1, 0.3, "s", why="told otherwise")) == ""
    assert why_no_interval(Estimate.missing("s", "nothing told it")) == ""  # the words for it say so


def test_a_value_near_an_end_of_its_interval_does_not_stand_at_it() -> None:
    assert words(Estimate(0.09998, 0.09956, 0.100006, "s")) == "0.09998 s (0.09956 to 0.10001)"
    assert words(Estimate(3e-6, 0.0, 11e-6, "um")) == "3 µm (0 to 11)"
    assert words(Estimate(0.0, 0.0, 11e-6, "um")) == "0 µm (0 to 11)"


def test_an_interval_that_leaves_out_zero_is_not_written_with_it() -> None:
    assert words(Estimate(-4e-6, -7.7e-6, -0.3e-6, "um")) == "−4.0 µm (−7.7 to −0.3)"
    assert words(Estimate(-0.01, -0.02, -0.0003)) == "−0.0100 (−0.0200 to −0.0003)"
    assert words(Estimate(4.0, 0.0, 8.0, "s")) == "4 s (0 to 8)"
    this, before, apart = subtracted(
        Estimate(100e-6, 98e-6, 102e-6, "um"), 104e-6, Estimate(-4e-6, -7.7e-6, -0.3e-6, "um")
    )
    assert (this, before, apart) == ("100.0 µm", "104.0 µm", "−4.0 µm (−7.7 to −0.3)")


def test_a_large_stiffness_has_a_prefix_and_its_kind_is_said() -> None:
    assert words(Estimate(4.2554e7, 3.8169e7, 4.7742e7, "N/m")) == "43 MN/m (38 to 48)"
    assert words(Estimate(0.0861, 0.0860, 0.0862, "N m")) == "86.10 mN m (86.00 to 86.20)"
    assert words(Estimate(3e-6, 2e-6, 4e-6, "um", kind="0-pk")) == "3.0 µm 0-pk (2.0 to 4.0)"


def test_a_force_is_no_amplitude() -> None:
    """A blow of 4.56 kN was "4.56 kN 0-pk"; archives and JSON keep the kind that they have of it."""
    blow, stress = Estimate(4560.0, 4420.0, 4700.0, "N", kind="0-pk"), Estimate(2.304e9, unit="MPa", kind="0-pk")
    assert words(blow) == "4.56 kN (4.42 to 4.70)" and short(stress) == "2304 MPa"
    assert subtracted(stress, 2.2e9, Estimate(0.104e9, unit="MPa"))[:2] == ("2304 MPa", "2200 MPa")


def test_a_long_number_of_a_unit_without_prefixes_has_a_power_of_ten() -> None:
    assert words(Estimate(1302123761.0, 1.2e9, 1.4e9, "N/m^(10/9)")) == "1.30 ×10⁹ N/m^(10/9) (1.20 to 1.40)"
    assert words(Estimate(2.5e6, 2e6, 3e6)) == "2.5 ×10⁶ (2.0 to 3.0)"
    assert words(Estimate(1e-8, 0.0, 1.44e-6)) == "0.01 ×10⁻⁶ (0.00 to 1.44)"
    assert words(Estimate(2500.0, 2400.0, 2600.0, "MPa")) == "0.00250 MPa (0.00240 to 0.00260)"


def test_a_terminal_gets_plain_letters_in_numbers_and_names_keep_theirs() -> None:
    assert printed(Estimate(-3e-6, -4e-6, -2e-6, "um")) == "-3.0 um (-4.0 to -2.0)"
    assert printed(Estimate(3e-6, 2e-6, 4e-6, "N m")) == "3.0 uN m (2.0 to 4.0)"
    assert plain("Prüfstand µ: −1.2 µm (−12.0 to 9.6), 5 µs") == "Prüfstand µ: -1.2 um (-12.0 to 9.6), 5 us"


def test_what_a_file_states_keeps_its_digits() -> None:
    """By the width of its tolerance a damping of 5.5 kN s/m was "6 kN s/m (3 to 8)"."""
    assert toleranced(Tolerant(nominal=5500.0, low=3300.0, high=7700.0), "N s/m") == "5.5 kN s/m (3.3 to 7.7)"
    assert toleranced(Tolerant(nominal=0.0, low=-0.349, high=0.349), "deg") == "0° (−20 to 20)"
    assert (
        toleranced(Tolerant(nominal=1.3e9, low=1.3e9, high=1.3e9), "N/m^(10/9)") == "1.3 ×10⁹ N/m^(10/9) (no tolerance)"
    )


def test_a_missing_value_says_why() -> None:
    assert words(Estimate.missing("um", "no swing")) == "not estimated: no swing"
    assert short(Estimate.missing("um", "no swing")) == "–"


def test_a_check_tells_no_length_finer_than_a_probe_does() -> None:
    lengths = (5.543e-9, 0.4734e-6, 1.246e-6, 30.56e-6, 473.4e-6, 250e-6)
    assert [um(length) for length in lengths] == ["0.0055 um", "0.47 um", "1.2 um", "30.6 um", "473.4 um", "250 um"]


def test_no_negative_zero_and_a_true_minus() -> None:
    assert number(-0.001, 1.0) == "0.0"
    assert number(-2.0, 1.0) == "−2.0"


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e5))
def test_rounding_moves_a_number_by_at_most_an_eighth_of_its_interval(value: float, width: float) -> None:
    shown = float(number(value, width).replace("−", "-"))
    assert abs(shown - value) <= 0.1251 * width + 1e-9 * abs(value)


@given(st.floats(1e-6, 1e-3), st.floats(1e-6, 1e-3), st.floats(1e-7, 1e-3))
def test_a_difference_is_that_of_the_numbers_beside_it(value: float, before: float, half: float) -> None:
    """Told with the digits of the interval alone, a drop of 3 µm after 5 µm differed by -1 µm."""
    apart = value - before
    for difference in (Estimate(apart, apart - half, apart + half, "um"), Estimate(apart, unit="um")):
        texts = subtracted(Estimate(value, unit="um", kind="0-pk"), before, difference)
        this, old, told = (Decimal(text.split()[0].replace("−", "-")) for text in texts)
        assert this - old == told
        assert abs(float(old) * 1e-6 - before) <= 10.0 ** (told.as_tuple().exponent - 6)
    assert subtracted(Estimate(3.4e-6, unit="um"), 4.6e-6, Estimate(-1.2e-6, -12e-6, 9.6e-6, "um")) == (
        "3.4 µm", "4.6 µm", "−1.2 µm (−12.0 to 9.6)",
    )  # fmt: skip
    assert subtracted(Estimate(31e6, unit="N/m"), 30.7e6, Estimate(0.3e6, unit="N/m"))[2] == "0.30 MN/m"


def test_a_time_since_the_release_carries_both_errors() -> None:
    touch = Estimate.from_sigma(0.108, 3e-4, "s", "touch")
    release = Estimate.from_sigma(0.1, 4e-4, "s", "release")
    span = since(touch, release)
    assert span.value == pytest.approx(0.008)
    assert span.high is not None and span.value is not None
    assert (span.high - span.value) / 1.96 == pytest.approx(5e-4)


def test_what_follows_the_release_does_not_come_before_it() -> None:
    span = since(Estimate.from_sigma(0.1002, 3e-4, "s", "touch"), Estimate.from_sigma(0.1, 4e-4, "s", "release"))
    assert span.low == 0.0


def test_a_time_since_an_unknown_release_is_missing() -> None:
    touch = Estimate.from_sigma(0.108, 3e-4, "s", "touch")
    assert not since(touch, None).known
    assert since(touch, Estimate.missing("s", "cut off")).why == "cut off"
    assert since(Estimate.missing("s", "none"), touch).why == "none"


def test_speed_is_also_given_in_rpm() -> None:
    assert rpm(Estimate(100.0, 99.9, 100.1, "Hz")) == "100.00 Hz (99.90 to 100.10), 6000 rpm"
    assert rpm(Estimate(95.01021, 95.0080, 95.0126, "Hz")).endswith(", 5701 rpm")


def test_a_place_is_no_finer_than_a_probe_tells() -> None:
    """The mean of a thousand samples was "−19.783 µm (−19.799 to −19.767)"; a line of nanometres keeps its digits."""
    assert words(Estimate(-19.7832e-6, -19.7991e-6, -19.7670e-6, "um")) == "−19.78 µm (−19.80 to −19.77)"
    assert words(Estimate(5.54e-9, 5.41e-9, 5.67e-9, "um")) == "0.00554 µm (0.00541 to 0.00567)"


def test_a_small_share_has_no_power_of_ten_beside_an_interval_without() -> None:
    """A friction's slope was "−108 ×10⁻⁶ (−307 to 155)"."""
    assert words(Estimate(-108e-6, -307e-6, 155e-6)) == "−0.0001 (−0.0003 to 0.0002)"


def test_moments_are_written_as_people_do_and_other_words_are_left_alone() -> None:
    assert moment("2026-03-10T09:00:00Z") == "2026-03-10 09:00:00 UTC"
    assert moment("2026-03-10T09:00:00") == "2026-03-10 09:00:00"
    assert moment("last <week>") == "last <week>"


def test_every_unit_of_an_estimate_can_be_written() -> None:
    from tdbmon.estimate import OUTSIDE

    for unit in OUTSIDE:
        text = words(Estimate(1.0, 0.5, 1.5, unit))
        assert "(" in text and not math.isnan(float(text.split()[0].replace("°", "")))


def test_per_cent_is_written_in_one_way() -> None:
    assert [percent(0.05), percent(0.0512, 1), percent(-0.032), percent(-1e-9)] == ["5 %", "5.1 %", "−3 %", "0 %"]
    assert [off_by(1.012), off_by(0.97), off_by(1.0)] == ["+1.2 %", "−3.0 %", "+0.0 %"]
    sources = [*Path(tdbmon.__file__).parent.rglob("*.py"), *Path(tdbsim.__file__).parent.rglob("*.py")]
    assert len(sources) > 100
    # the format of a percentage has no space before its sign
    assert not [file.name for file in sources if re.search(r":[^{}]*\d%\}", file.read_text(encoding="utf-8"))]


def test_a_count_has_no_decimals():
    """A margin of three drops was "3.000", one of twenty "20.00"."""
    assert [words(Estimate(value, unit="1")) for value in (20.0, 3.0, 0.0, -2.0)] == ["20", "3", "0", "−2"]
    assert words(Estimate(3e-6, unit="um")) == "3.000 µm"
    assert words(Estimate(1.25, unit="1")) == "1.250"
