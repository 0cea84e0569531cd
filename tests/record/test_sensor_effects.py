"""Readings freed of the machine file's sensor effects are those of sound sensors."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from tdbsim.machine import EffectSetting, Machine, load_machine
from tdbsim.sensors import SensorChain, clean_readings
from tdbsim.stated_effects import from_setting

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.axes import to_planes
from tdbmon.record.read import read
from tdbmon.record.sensor_effects import check_effects, freed
from tdbmon.shipped import shipped
from tests.shipped_drops import analysed

SAMPLING = 20000.0
SENSORS = {
    "gain": EffectSetting(name="probe_gain", where="NDE_A", gain=1.17),
    "angle": EffectSetting(name="probe_angle", where="DE_B", error="9 deg"),
    "crosstalk": EffectSetting(name="probe_crosstalk", where="DE", factor=-0.2, into="first"),
    "lag": EffectSetting(name="channel_lag", where="NDE_B", delay="130 us"),
}


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(shipped("short/machine.toml"))


def _carrying(machine: Machine, *settings: EffectSetting) -> Machine:
    return machine.model_copy(update={"effects": settings})


def _readings(machine: Machine) -> xr.Dataset:
    """What the machine's sensors, with its effects, read of a rigid rotor that turns in two frequencies."""
    time = np.arange(2000) / SAMPLING
    position = np.array([probe.position for probe in machine.probes])[:, None]
    x = 2e-4 * np.cos(300 * time) + 1e-4 * position * np.sin(740 * time)
    y = 1e-4 * np.sin(300 * time) - 3e-4 * position * np.cos(410 * time)
    chain = SensorChain()
    for setting in machine.effects:
        chain = from_setting(setting).sense(chain, machine, SAMPLING)
    rows = clean_readings(x, y, 600 * time, machine.probes, chain)
    data = {probe.name: ("time", row) for probe, row in zip(machine.probes, rows, strict=True)}
    return xr.Dataset(data, coords={"time": time})


@pytest.mark.parametrize("which", [(name,) for name in SENSORS] + [tuple(SENSORS)], ids="+".join)
def test_the_orbit_is_that_of_sound_sensors(which: tuple[str, ...], machine: Machine) -> None:
    carrying = _carrying(machine, *(SENSORS[name] for name in which))
    sound, faulty = _readings(machine), _readings(carrying)
    truth = to_planes(sound, machine).displacement.to_numpy()[..., 10:-10]
    raw = to_planes(faulty, machine).displacement.to_numpy()[..., 10:-10]
    found = to_planes(*freed(faulty, carrying)).displacement.to_numpy()[..., 10:-10]
    assert np.abs(raw - truth).max() > 3e-6
    assert np.abs(found - truth).max() < 1e-9


def test_what_a_late_channel_has_not_yet_recorded_is_missing(machine: Machine) -> None:
    carrying = _carrying(machine, SENSORS["lag"])
    record = _readings(carrying)
    record["NDE_B"][700:720] = np.nan
    out, _ = freed(record, carrying)
    missing = np.flatnonzero(np.isnan(out["NDE_B"].values))
    assert missing.tolist() == [*range(697, 718), 1997, 1998, 1999]  # 2.6 samples earlier
    assert np.isfinite(out["NDE_A"].values).all()


def test_a_lag_is_taken_back_by_the_rate_of_its_own_channel(machine: Machine) -> None:
    """The first probe of the machine is sampled at a quarter of the others' rate."""
    late = EffectSetting(name="channel_lag", where="DE_A", delay="1 ms")

    def slower(record: xr.Dataset) -> xr.Dataset:
        first = record["NDE_A"][::4].rename(time="time_2")
        return record.drop_vars("NDE_A").assign(NDE_A=first)

    carrying = _carrying(machine, late)
    truth, (found, _) = slower(_readings(machine)), freed(slower(_readings(carrying)), carrying)
    assert np.abs(found["DE_A"] - truth["DE_A"])[20:-20].max() < 1e-9
    xr.testing.assert_identical(found["NDE_A"], truth["NDE_A"])


def test_runout_and_what_is_no_sensor_change_nothing(machine: Machine) -> None:
    others = (
        EffectSetting(name="probe_runout", where="NDE", first="8 um", first_phase="20 deg"),
        EffectSetting(name="oval_clearance", where="DE", amplitude="20 um", angle="10 deg"),
    )
    record = _readings(machine)
    out, same = freed(record, _carrying(machine, *others))
    assert out.identical(record)
    assert same.probes == machine.probes


def test_an_analysis_with_the_gain_in_the_machine_file_finds_the_gap_of_a_sound_record(machine: Machine) -> None:
    carrying = _carrying(machine, EffectSetting(name="probe_gain", where="NDE_A", gain=1.05))
    record = read(shipped("short/drop_100.nc"))
    name = machine.channel_in_file("NDE_A")
    faulty = record.copy()
    faulty[name] = record[name] * 1.05
    sound, wrong, right = analysed("short/drop_100"), analyse(faulty, machine), analyse(faulty, carrying)
    true = sound.ends["NDE"].gap.radius.value
    assert abs(wrong.ends["NDE"].gap.radius.value - true) > 5e-6
    assert right.ends["NDE"].gap.radius.value == pytest.approx(true, abs=1e-8)
    (row,) = [each for each in right.checks if each.check == "effects"]
    assert "probe_gain at NDE_A: readings are corrected" in row.detail


def test_an_angle_that_differs_from_drop_to_drop_is_said_to_be_that_of_one(machine: Machine) -> None:
    ring = EffectSetting(name="ring_out_of_round", where="NDE", amplitude=8e-6)
    outer = EffectSetting(name="race_waviness", where="DE", amplitude=2e-6, race="outer")  # which does not turn
    (row,) = check_effects(_carrying(machine, ring, EffectSetting(name="ring_drag", where="DE"), outer))
    assert "ring_out_of_round at NDE: the machine file states its angle in one drop" in row.detail
    assert "ring_drag at DE: the machine" not in row.detail


def test_a_lone_probe_of_an_end_keeps_what_leaked(machine: Machine) -> None:
    carrying = _carrying(machine, SENSORS["crosstalk"])
    record = _readings(carrying).drop_vars("DE_B")
    assert freed(record, carrying)[0].identical(record)


def test_the_order_of_effects_does_not_matter(machine: Machine) -> None:
    there = freed(_readings(machine), _carrying(machine, *SENSORS.values()))[0]
    back = freed(_readings(machine), _carrying(machine, *reversed(SENSORS.values())))[0]
    xr.testing.assert_allclose(there, back, rtol=0, atol=1e-15)


def test_what_leaks_into_a_late_channel_is_freed_of_its_lag_too(machine: Machine) -> None:
    leak = EffectSetting(name="probe_crosstalk", where="NDE", factor=0.15)  # into the late channel
    carrying = _carrying(machine, SENSORS["lag"], leak)
    truth = to_planes(_readings(machine), machine).displacement.to_numpy()[..., 10:-10]
    found = to_planes(*freed(_readings(carrying), carrying)).displacement.to_numpy()[..., 10:-10]
    assert np.abs(found - truth).max() < 1e-9
