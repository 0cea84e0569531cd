"""Units at the edges: the traps of the trade, by hand-computed factors."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.errors import InputError
from tdbsim.units import is_unit, scale, si_unit_of, split_kind, to_si


@pytest.mark.parametrize(
    ("text", "si", "expected"),
    [
        ("250 um", "m", 250e-6),
        ("250 µm", "m", 250e-6),
        ("1 mil", "m", 25.4e-6),
        ("3000 rpm", "Hz", 50.0),
        ("100 Hz", "Hz", 100.0),
        (f"{2 * math.pi} rad/s", "Hz", 1.0),
        ("40 g mm", "kg m", 40e-6),
        ("15 mN m", "N m", 0.015),
        ("0.08 kg m^2", "kg m^2", 0.08),
        ("180 deg", "rad", math.pi),
        ("7.87 mV/um", "V/m", 7870.0),
        ("400 N s/m", "N s/m", 400.0),
        ("20 %", "1", 0.2),
        (0.3, "1", 0.3),
        ("0.08 s/m", "s/m", 0.08),
        ("200 mV/mil", "V/m", 0.2 / 25.4e-6),
        ("15 mNm", "N m", 0.015),
        ("2 Ns/m", "N s/m", 2.0),
        ("0.08 kgm2", "kg m^2", 0.08),
        ("40 gmm", "kg m", 40e-6),
        ("7850 kg/m3", "kg/m^3", 7850.0),
        ("5 nm", "m", 5e-9),
        ("5 Nm", "N m", 5.0),
    ],
)
def test_text_to_si(text, si, expected):
    assert to_si(text, si) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    "text", ["250 kg", "um", "twelve um", "5 furlongs per fortnight", "nan", True, None, [1], "1 um pp"]
)
def test_nonsense_is_refused_with_the_text(text):
    with pytest.raises(InputError, match="quantity|unit|finite|amplitude"):
        to_si(text, "m")


@pytest.mark.parametrize(
    "text",
    ["cycles/min", "Cycles/min", "cpm", "CPM", "1/min", "min-1", "min^-1", "min⁻¹", "/min", "U/min", "Umdr./min", "tr/min",
     "r/min", "rev/min", "r.p.m."],
)  # fmt: skip
def test_turns_a_minute_are_counted_in_every_language(text):
    assert si_unit_of(text) == ("Hz", pytest.approx(1 / 60, rel=1e-12))


@pytest.mark.parametrize("text", ["cycles/s", "U/s", "tr/s", "rev/sec", "turns/s", "1/s", "s-1", "/s", "Hz"])
def test_turns_a_second_are_hertz(text):
    assert si_unit_of(text) == ("Hz", pytest.approx(1.0, rel=1e-12))


@pytest.mark.parametrize(
    ("text", "volts_per_hz"),
    [
        ("1 mV/Hz", 1e-3),
        ("1 mV s", 1e-3),
        ("1 mV/rpm", 0.06),
        ("1 mV/(U/min)", 0.06),
        ("1 mV/min-1", 0.06),
        ("1 V s/rad", 2 * math.pi),
    ],
)
def test_volts_of_a_speed_signal_count_turns(text, volts_per_hz):
    assert to_si(text, "V s") == pytest.approx(volts_per_hz, rel=1e-12)


@pytest.mark.parametrize("text", ["Mikrometer", "mikrometer", "æm", "micron"])
def test_micrometres_by_other_names(text):
    assert scale(text, "m") == pytest.approx(1e-6)


def test_direct_volts_are_volts():
    assert si_unit_of("VDC") == si_unit_of("V DC") == ("V", 1.0)
    assert si_unit_of("Vrms") is None


def test_what_is_no_unit_at_all_is_told_from_one_of_another_quantity():
    assert is_unit("kPa") and is_unit("um pp") and is_unit("µm RMS")
    assert not is_unit("bananas")


def test_frequency_refuses_a_length():
    with pytest.raises(InputError, match="rpm"):
        scale("um", "Hz")


def test_peak_to_peak_is_a_kind_not_a_unit():
    assert split_kind("um pp") == ("um", "pk-pk")
    assert split_kind("mil pk-pk") == ("mil", "pk-pk")
    assert split_kind("g mm") == ("g mm", None)


def test_channel_units_of_instruments():
    assert si_unit_of("Volts") == ("V", 1.0)
    assert si_unit_of("mils") == ("m", pytest.approx(25.4e-6))
    assert si_unit_of("rpm") == ("Hz", pytest.approx(1 / 60))
    assert si_unit_of("RPM") == ("Hz", pytest.approx(1 / 60))
    assert si_unit_of("%") == ("1", pytest.approx(0.01))
    assert si_unit_of("") == si_unit_of("-") == si_unit_of("counts") == ("1", 1.0)
    assert si_unit_of("deg") == ("rad", pytest.approx(math.pi / 180))
    assert si_unit_of("bananas") is None


@given(st.floats(-1e6, 1e6, allow_subnormal=False))
def test_metres_and_micrometres_agree(value):
    assert to_si(f"{value!r} um", "m") == pytest.approx(value * 1e-6, rel=1e-12, abs=1e-300)
