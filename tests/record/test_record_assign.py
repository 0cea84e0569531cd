"""Channels of a file become the machine's probes, speed and keyphasor; nothing is guessed."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr
from record_machine import machine, with_probe
from tdbsim.errors import InputError

from tdbmon.record.assign import assign

NAMES = ("NDE_A", "NDE_B", "DE_A", "DE_B")


def _record(**units: str) -> xr.Dataset:
    """Return a record of ten samples: every channel counts from 0, in the unit asked for."""
    units = {**dict.fromkeys(NAMES, "m"), "speed": "Hz", "keyphasor": "1", **units}
    ds = xr.Dataset({name: ("time", np.arange(10.0)) for name in units}, coords={"time": np.arange(10) / 1000})
    for name, unit in units.items():
        ds[name].attrs = {"units": unit, "source_units": unit}
    ds.attrs["source_file"] = "drop.nc"
    return ds


def test_a_complete_record_is_taken_as_it_is() -> None:
    out = assign(_record(temperature="degC"), machine())
    assert list(out.data_vars) == [*NAMES, "speed", "keyphasor"]
    assert out.attrs["missing"] == []
    assert out.attrs["unused"] == ["temperature"]
    np.testing.assert_array_equal(out["NDE_A"].values, np.arange(10.0))


def test_what_the_file_lacks_is_listed_and_not_invented() -> None:
    out = assign(_record().drop_vars(["DE_B", "keyphasor"]), machine())
    assert out.attrs["missing"] == ["DE_B", "keyphasor"]
    assert "DE_B" not in out


@pytest.mark.parametrize("label", ["NDE_A_um", "NDE_A [um]"])
def test_a_channel_may_be_named_with_the_unit_that_the_file_has_in_its_name(label: str) -> None:
    np.testing.assert_array_equal(assign(_record(), machine(channels={"NDE_A": label}))["NDE_A"].values, np.arange(10.0))


def test_the_channels_table_may_swap_names() -> None:
    ds = _record()
    ds["NDE_A"] = ds["NDE_A"] + 100.0
    ds["NDE_A"].attrs = {"units": "m"}
    out = assign(ds, machine(channels={"NDE_A": "NDE_B", "NDE_B": "NDE_A"}))
    assert out["NDE_A"].values[0] == 0.0
    assert out["NDE_B"].values[0] == 100.0


@pytest.mark.parametrize("unit", ["V", "1", ""])
def test_volts_become_displacement(unit: str) -> None:
    ds = _record(NDE_A=unit)
    ds["NDE_A"].attrs["full_scale"] = [-10.0, 10.0]
    out = assign(ds, with_probe("NDE_A", sensitivity="-8 mV/um", offset="-9 V"))
    np.testing.assert_allclose(out["NDE_A"].values, (np.arange(10.0) + 9.0) / -8000.0, rtol=1e-14)
    np.testing.assert_allclose(out["NDE_A"].attrs["full_scale"], [-19.0 / 8000, 1.0 / 8000], rtol=1e-14)
    assert out["NDE_A"].attrs["units"] == "m"


@pytest.mark.parametrize("unit", ["", "1"])
@pytest.mark.parametrize(("stated", "factor"), [("um", 1e-6), ("mm", 1e-3), ("mil", 25.4e-6), ("m", 1.0)])
def test_the_machine_file_states_the_unit_that_a_file_does_not(unit: str, stated: str, factor: float) -> None:
    ds = _record(NDE_A=unit)
    ds["NDE_A"].attrs["full_scale"] = [-250.0, 250.0]
    out = assign(ds, with_probe("NDE_A", unit=stated))
    np.testing.assert_allclose(out["NDE_A"].values, np.arange(10.0) * factor, rtol=1e-14)
    np.testing.assert_allclose(out["NDE_A"].attrs["full_scale"], [-250 * factor, 250 * factor], rtol=1e-14)
    assert out["NDE_A"].attrs["units"] == "m"


def test_a_stated_voltage_goes_through_the_sensitivity() -> None:
    out = assign(_record(NDE_A=""), with_probe("NDE_A", unit="mV", sensitivity="8 mV/um", offset="-9 V"))
    np.testing.assert_allclose(out["NDE_A"].values, (np.arange(10.0) * 1e-3 + 9.0) / 8000.0, rtol=1e-14)
    with pytest.raises(InputError, match="is in V; give probe 'NDE_A' its sensitivity"):
        assign(_record(NDE_A=""), with_probe("NDE_A", unit="mV"))


def test_the_file_s_own_unit_goes_before_that_of_the_machine_file() -> None:
    ds = _record(NDE_A="m")
    out = assign(ds, with_probe("NDE_A", unit="mm"))
    np.testing.assert_array_equal(out["NDE_A"].values, ds["NDE_A"].values)


@pytest.mark.parametrize("unit", ["furlong-ish", "Mikron (gemittelt)"])
def test_the_machine_file_states_a_unit_that_the_file_calls_by_a_word_of_its_own(unit: str) -> None:
    out = assign(_record(NDE_A=unit), with_probe("NDE_A", unit="um"))
    np.testing.assert_allclose(out["NDE_A"].values, np.arange(10.0) * 1e-6, rtol=1e-14)
    out = assign(_record(speed=unit), machine(speed={"channel": "speed", "unit": "rpm"}))
    np.testing.assert_allclose(out["speed"].values, np.arange(10.0) / 60, rtol=1e-14)


@pytest.mark.parametrize("unit", ["kPa", "degC", "um pp", "µm RMS"])
def test_the_machine_file_does_not_turn_another_quantity_into_a_displacement(unit: str) -> None:
    with pytest.raises(InputError, match="but a displacement"):
        assign(_record(NDE_A=unit), with_probe("NDE_A", unit="um"))


def test_an_unknown_unit_can_be_said_in_the_machine_file() -> None:
    with pytest.raises(InputError, match="state the unit in the machine file, e.g. unit = \"um\" for probe 'NDE_A'"):
        assign(_record(NDE_A="bananas"), machine())
    with pytest.raises(InputError, match=r"state the unit in the machine file, e.g. \[speed\] unit = \"rpm\""):
        assign(_record(speed="bananas"), machine())


def test_all_channels_without_a_unit_or_a_sensitivity_are_named_at_once() -> None:
    with pytest.raises(InputError) as error:
        assign(_record(NDE_A="", NDE_B="1", DE_A="V", speed=""), machine())
    said = str(error.value)
    assert said.startswith("drop.nc: channels 'NDE_A', 'NDE_B', 'speed' without a unit: give it in the machine file")
    assert 'unit = "um"' in said and '[speed] unit = "rpm"' in said
    assert "; 'DE_A' in V without a sensitivity: give it in the machine file, e.g. sensitivity =" in said


@pytest.mark.parametrize("unit", ["bananas", "um", ""])
def test_a_speed_s_unit_is_a_speed_or_a_voltage(unit: str) -> None:
    with pytest.raises(InputError, match="neither a speed nor a voltage"):
        machine(speed={"channel": "speed", "unit": unit})


def test_a_speed_signal_without_sensitivity_to_speed_is_refused() -> None:
    with pytest.raises(InputError, match="sensitivity 0 V s gives no speed"):
        machine(speed={"channel": "speed", "sensitivity": 0.0})


@pytest.mark.parametrize("unit", ["Hz", "kPa", "um pp", ""])
def test_a_probe_s_unit_is_a_length_or_a_voltage(unit: str) -> None:
    with pytest.raises(InputError, match="neither a length nor a voltage"):
        with_probe("NDE_A", unit=unit)


@pytest.mark.parametrize(
    ("unit", "message"),
    [
        ("V", "is in V; give probe 'NDE_A' its sensitivity"),
        ("1", "has no unit"),
        ("", "has no unit"),
        ("Hz", r"is a speed or frequency \(Hz\)"),
        ("m/s^2", "is an acceleration"),
        ("um pp", "is a pk-pk amplitude"),
        ("spans", "in 'spans', but a displacement"),
    ],
)
def test_a_displacement_in_a_wrong_unit_is_refused(unit: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        assign(_record(NDE_A=unit), machine())
    assert str(caught.value).startswith("drop.nc: channel 'NDE_A'")


@pytest.mark.parametrize(
    ("signal", "unit", "factor"),
    [
        ({"channel": "speed"}, "Hz", 1.0),
        ({"channel": "speed", "unit": "rpm"}, "", 1 / 60),
        ({"channel": "speed", "unit": "rpm"}, "1", 1 / 60),
        ({"channel": "speed", "unit": "rad/s"}, "", 1 / (2 * np.pi)),
        ({"channel": "speed", "sensitivity": "20 mV s"}, "V", 50.0),
        ({"channel": "speed", "unit": "mV", "sensitivity": "20 mV s"}, "", 0.05),
        ({"channel": "speed", "sensitivity": "20 mV/rpm"}, "V", 1 / 1.2),
    ],
)
def test_speed_in_many_units(signal: dict[str, str], unit: str, factor: float) -> None:
    out = assign(_record(speed=unit), machine(speed=signal))
    np.testing.assert_allclose(out["speed"].values, np.arange(10.0) * factor, rtol=1e-14)
    assert out["speed"].attrs["units"] == "Hz"


@pytest.mark.parametrize(
    ("unit", "message"), [("V", r"\[speed\] sensitivity"), ("", r"\[speed\] unit"), ("m", "is a displacement")]
)
def test_a_speed_that_cannot_be_turned_into_hz_is_refused(unit: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        assign(_record(speed=unit), machine())


def test_the_cure_for_a_speed_in_volts_can_be_copied_into_the_machine_file() -> None:
    with pytest.raises(InputError) as caught:
        assign(_record(speed="V"), machine())
    told = re.search(r'\[speed\] sensitivity = "(.+)"', str(caught.value))
    assert told is not None and told[1] == "1 mV/rpm"  # as tachometers are specified
    out = assign(_record(speed="V"), machine(speed={"channel": "speed", "sensitivity": told[1]}))
    np.testing.assert_allclose(out["speed"].values, np.arange(10.0) * 1000 / 60)


def test_no_channel_at_all_lists_the_file_and_the_cure() -> None:
    ds = _record()[["NDE_A", "speed"]].rename(NDE_A="NDE-A", speed="temperature")
    with pytest.raises(InputError) as caught:
        assign(ds, machine())
    message = str(caught.value)
    assert "'NDE-A', 'temperature'" in message
    assert "('NDE_A' expected; did you mean 'NDE-A'?)" in message
    assert "[channels]" in message


def test_one_channel_cannot_be_two_probes() -> None:
    with pytest.raises(InputError, match="'NDE_A' and 'NDE_B' are both assigned channel 'NDE_B'"):
        assign(_record(), machine(channels={"NDE_A": "NDE_B"}))


def test_the_probes_time_base_becomes_time() -> None:
    ds = xr.Dataset(coords={"time": np.arange(5) / 10, "time_2": np.arange(50) / 100})
    ds["temperature"] = ("time", np.zeros(5))
    for name in NAMES:
        ds[name] = ("time_2", np.zeros(50), {"units": "m"})
    ds["speed"] = ("time", np.zeros(5), {"units": "Hz"})
    out = assign(ds, machine())
    assert out["NDE_A"].dims == ("time",)
    assert out["speed"].dims == ("time_2",)
    assert out.sizes == {"time": 50, "time_2": 5}


def _two_probes(values, time):
    record = xr.Dataset({name: ("time", values, {"units": "m"}) for name in ("NDE_A", "NDE_B")}, coords={"time": time})
    return record.assign_attrs(source_file="drop.csv")


def test_what_is_infinite_is_missing():
    values = np.linspace(-1e-4, 1e-4, 200)
    values[[3, 50]] = np.inf, -np.inf
    found = assign(_two_probes(values, np.arange(200) * 1e-4), machine())
    assert np.flatnonzero(np.isnan(found.NDE_A.values)).tolist() == [3, 50]


@pytest.mark.parametrize(("pause", "refused"), [(0.4, False), (0.6, True), (86400.0, True)])
def test_a_record_that_pauses_is_refused(pause, refused):
    time = np.arange(200) * 1e-4
    time[120:] += pause
    record = _two_probes(np.linspace(-1e-4, 1e-4, 200), time)
    if not refused:
        assert assign(record, machine()).time.size == 200
        return
    with pytest.raises(InputError, match=r"drop.csv: no samples for .* s after 0.0119 s; cut the record there"):
        assign(record, machine())


def test_a_record_that_holds_nothing_is_said_to() -> None:
    with pytest.raises(InputError, match="it has no channel; assign"):
        assign(xr.Dataset(attrs={"source_file": "drop.nc"}), machine())
