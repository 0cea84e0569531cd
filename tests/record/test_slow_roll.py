"""Slow roll that the machine file states is taken off readings, by the keyphasor's angle, and put on simulated ones."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Keyphasor, Machine, SlowRoll, load_machine, parse_machine
from tdbsim.sensors import SensorChain, keyphasor_pulses
from tdbsim.simulate import DropPlan, simulate

from tdbmon.analysis.analyse import analyse
from tdbmon.identify.drop import measured_drop
from tdbmon.machine_file import write_machine
from tdbmon.record.assign import assign
from tdbmon.record.quality import check
from tdbmon.record.slow_roll import check_slow_roll, without_slow_roll
from tdbmon.shipped import shipped

SAMPLING = 20000.0
LAGS_DEG = {"NDE_A": 30.0, "NDE_B": 145.0, "DE_A": 200.0, "DE_B": 310.0}
QUIET = SensorChain()
# of 10 um at 90 Hz: pulses are dated to half a sample, planes are carried over by a tenth, the converter has steps of 0.03 um
LEFT = 1.1 * 10e-6 * 2 * math.pi * 90.0 * 0.5 / SAMPLING + 0.04e-6


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(shipped("short/machine.toml"))


def rolling(machine: Machine, peak_to_peak: float = 20e-6, **also: object) -> Machine:
    """The machine with a slow roll at each probe."""
    probes = tuple(
        probe.model_copy(
            update={"slow_roll": SlowRoll(peak_to_peak=peak_to_peak, phase_lag=math.radians(LAGS_DEG[probe.name]))}
        )
        for probe in machine.probes
    )
    return machine.model_copy(update={"probes": probes, **also})


@pytest.mark.parametrize("rotation", ["ccw", "cw"])
def test_the_greatest_reading_comes_a_phase_lag_after_the_pulse(rotation: str, machine: Machine) -> None:
    """By the definition of a phase lag: of a shaft that only turns, each probe reads most so far after the edge."""
    turning = rolling(machine, rotation=rotation, keyphasor=Keyphasor(channel="keyphasor", angle=math.radians(70)))
    drop = simulate(turning, DropPlan(speed=25.0, seconds=0.001, levitated=0.4, sampling=SAMPLING, sensors=QUIET))
    plain = simulate(
        turning.model_copy(update={"probes": machine.probes}),
        DropPlan(speed=25.0, seconds=0.001, levitated=0.4, sampling=SAMPLING, sensors=QUIET),
    )
    time, level = drop.time.to_numpy(), drop.keyphasor.to_numpy()
    edge = time[1:][np.diff(level) > 0][2]
    for name, lag in LAGS_DEG.items():
        roll = (drop[name] - plain[name]).to_numpy()
        turn = (time >= edge) & (time < edge + 1 / 25.0)
        greatest = time[turn][np.argmax(roll[turn])] - edge
        assert np.ptp(roll[turn]) == pytest.approx(20e-6, rel=1e-2)
        # flat at its top, and counted in steps of the converter: a few degrees
        assert abs((360 * 25.0 * greatest - lag + 180) % 360 - 180) < 8.0


@pytest.mark.parametrize("rotation", ["ccw", "cw"])
def test_a_drop_tells_the_same_with_slow_roll_as_without(rotation: str, machine: Machine) -> None:
    plain = machine.model_copy(update={"rotation": rotation})
    plan = DropPlan(speed=90.0, seconds=0.25, levitated=0.15, sampling=SAMPLING, sensors=QUIET, seed=3)
    stated = rolling(plain)
    sound, rolls = simulate(plain, plan), simulate(stated, plan)
    truth, found, ignored = analyse(sound, plain), analyse(rolls, stated), analyse(rolls, plain)
    apart = float(np.abs(found.planes.displacement - truth.planes.displacement).max())
    assert apart < LEFT
    assert float(np.abs(ignored.planes.displacement - truth.planes.displacement).max()) > 8e-6
    for end in plain.ends:
        once = [each.levitation[end].once.value for each in (truth, found, ignored)]
        assert once[1] == pytest.approx(once[0], abs=0.1e-6)
        assert abs(once[2] - once[0]) > 3e-6
    (check,) = [each for each in found.checks if each.check == "slow roll"]
    assert check.passed and "NDE_A 20 um pk-pk" in check.detail and "all readings" in check.detail
    assert not [each for each in truth.checks if each.check == "slow roll"]


def test_run_out_against_the_rotation_accuses_no_probe(machine: Machine) -> None:
    """Unlike run-out under an end's two probes looks like backward whirl, which a levitated shaft hardly has."""
    lags = {"NDE_A": 0.0, "NDE_B": 270.0, "DE_A": 0.0, "DE_B": 270.0}
    probes = tuple(
        probe.model_copy(update={"slow_roll": SlowRoll(peak_to_peak=40e-6, phase_lag=math.radians(lags[probe.name]))})
        for probe in machine.probes
    )
    stated = machine.model_copy(update={"probes": probes})
    drop = assign(simulate(stated, DropPlan(speed=90.0, seconds=0.25, levitated=0.15, sensors=QUIET)), stated)
    assert {each.passed for each in check(drop, stated) if each.check == "whirl"} == {True}
    assert {each.passed for each in check(drop, machine) if each.check == "whirl"} == {False}


def test_fits_are_made_to_readings_without_it(machine: Machine) -> None:
    plan = DropPlan(speed=90.0, seconds=0.25, levitated=0.15, sampling=SAMPLING, sensors=QUIET, seed=3)
    truth = measured_drop(simulate(machine, plan), machine)
    found = measured_drop(simulate(rolling(machine), plan), rolling(machine))
    assert np.abs(found.reading - truth.reading).max() < LEFT
    assert found.compensated and not truth.compensated


def turned_record(machine: Machine, until: float = math.inf) -> xr.Dataset:
    """A record of a shaft that turns and does nothing else, whose keyphasor ends at an instant, s."""
    time = np.arange(6000) / SAMPLING
    angle = machine.sense * 2 * math.pi * 100.0 * time
    pulses = np.where(time < until, keyphasor_pulses(angle, machine, 0.02), 0.0)
    data = {probe.name: ("time", np.full(len(time), 5e-6)) for probe in machine.probes}
    return xr.Dataset({**data, "keyphasor": ("time", pulses)}, coords={"time": time})


def test_where_the_keyphasor_has_ended_readings_stay_and_that_is_said(machine: Machine) -> None:
    stated = rolling(machine)
    record = turned_record(stated, until=0.2)
    found = without_slow_roll(record, stated)
    changed = np.abs(found.NDE_A - record.NDE_A).to_numpy() > 0
    assert changed[record.time < 0.19].mean() > 0.99
    assert not changed[record.time > 0.22].any()
    (check,) = check_slow_roll(record, stated)
    assert check.passed and "between 0 s and 0.19995 s" in check.detail


@pytest.mark.parametrize(("since", "taken_off"), [(0.015, True), (0.1, False)])  # at 100 Hz
def test_where_the_keyphasor_begins_late_readings_do_not_jump(machine: Machine, since: float, taken_off: bool) -> None:
    stated = rolling(machine)
    record = turned_record(stated)
    record["keyphasor"] = record.keyphasor.where(record.time > since, 0.0)
    changed = np.abs(without_slow_roll(record, stated).NDE_A - record.NDE_A).to_numpy() > 0
    assert changed.mean() == pytest.approx(float(taken_off), abs=0.01)
    (check,) = check_slow_roll(record, stated)
    assert check.passed == taken_off
    assert taken_off or "readings would jump there" in check.detail


def test_without_a_keyphasor_nothing_is_taken_off_and_that_fails(machine: Machine) -> None:
    stated = rolling(machine)
    record = turned_record(stated).drop_vars("keyphasor")
    assert without_slow_roll(record, stated) is record
    (check,) = check_slow_roll(record, stated)
    assert not check.passed and "no keyphasor pulses" in check.detail
    assert check_slow_roll(record, machine) == []


@pytest.mark.parametrize(
    ("keyphasor", "said"),
    [
        (None, "there is no [keyphasor]"),
        ({"channel": "keyphasor", "pulses_per_revolution": 60}, "this one has several"),
    ],
)
def test_a_phase_without_a_mark_is_refused(keyphasor: dict[str, object] | None, said: str) -> None:
    told = tomllib.loads(shipped("short/machine.toml").read_text())
    told["probe"][0]["slow_roll"] = {"peak_to_peak": "4 um", "phase_lag": "120 deg"}
    assert parse_machine(told).probes[0].slow_roll is not None
    del told["keyphasor"]
    with pytest.raises(InputError, match="phase of slow_roll needs a keyphasor") as refused:
        parse_machine(told | ({"keyphasor": keyphasor} if keyphasor else {}))
    assert said in str(refused.value)


def test_a_written_machine_file_keeps_it(machine: Machine, tmp_path) -> None:
    write_machine(rolling(machine, 7e-6), tmp_path / "machine.toml")
    back = load_machine(tmp_path / "machine.toml").probes[1].slow_roll
    assert back is not None
    assert back.peak_to_peak == pytest.approx(7e-6, rel=1e-12)
    assert back.phase_lag == pytest.approx(math.radians(145.0), rel=1e-12)
