"""How the shaft turns before the release, by its speed signal and keyphasor."""

import numpy as np
import pytest
import xarray as xr
from tdbsim.machine import load_machine

from tdbmon.identify.drop import measured_drop
from tdbmon.identify.turning import fit_turning
from tdbmon.record.assign import assign
from tdbmon.shipped import shipped
from tests.identify import drops

RELEASE, HZ, SLOWS = 0.4, 97.0, -7.0  # s, Hz, Hz/s
STEP = 5e-5  # s


@pytest.mark.parametrize("memory", [0.0, 0.005, 0.02])
@pytest.mark.parametrize("keyed", [False, True])
def test_the_acceleration_is_as_sure_as_it_says_of_a_smoothed_speed_too(memory, keyed):
    """Each sample taken for a measurement of its own, it was off by 35 of its standard deviations."""
    machine = load_machine(shipped("short/machine.toml"))
    time = np.arange(0, 0.5, 5e-5)
    turned = HZ * (time - RELEASE) + SLOWS * (time - RELEASE) ** 2 / 2
    away = []
    for seed in range(30):
        white = np.random.default_rng(seed).standard_normal(len(time) + 4000)
        keep = np.exp(-5e-5 / memory) if memory else 0.0
        noise = white.copy()
        for k in range(1, len(noise) if memory else 0):
            noise[k] = keep * noise[k - 1] + np.sqrt(1 - keep**2) * white[k]
        speed = HZ + SLOWS * (time - RELEASE) + 0.03 * noise[4000:]
        channels = {"speed": ("time", speed, {"units": "Hz"})}
        if keyed:
            channels["keyphasor"] = ("time", ((turned + 0.3 + 0.001 * seed) % 1.0 < 0.05).astype(float), {"units": "V"})
        record = xr.Dataset(channels, coords={"time": ("time", time, {"units": "s"})})
        found = fit_turning(assign(record, machine), machine, RELEASE, "drop")
        away.append((found.acceleration - 2 * np.pi * SLOWS) / found.acceleration_sigma)
    assert 0.3 < np.sqrt(np.mean(np.square(away))) < 1.9


def turned(hz):
    """Turns since the first of evenly sampled speeds (n,), Hz, of which the time between two samples is `STEP`."""
    return np.append(0.0, np.cumsum((hz[1:] + hz[:-1]) / 2 * STEP))


def pulse_train(turns):
    return ("time", (turns % 1.0 < 0.05).astype(float), {"units": "V"})


@pytest.mark.parametrize(
    ("levitated", "trip", "decay"), [(2.0, 0.5, 60.0), (5.0, 1.0, 60.0), (2.0, 0.1, 30.0), (1.0, 0.7, 12.0)]
)
@pytest.mark.parametrize("told_by", ["both", "keyphasor", "speed"])
def test_of_a_drive_that_trips_before_the_release_the_coasting_tells(levitated, trip, decay, told_by):
    """One parabola through all of it was 31 degrees off after 2 s, 283 of its standard deviations, and 0.6 Hz."""
    machine = load_machine(shipped("short/machine.toml"))
    time = STEP * np.arange(int((levitated + 0.1) / STEP))
    hz = 97.0 * np.exp(-np.maximum(time - (levitated - trip), 0.0) / decay)
    turns = turned(hz) + 0.37
    speed = hz + 0.03 * np.random.default_rng(1).standard_normal(len(time))
    channels = {"speed": ("time", speed, {"units": "Hz"}), "keyphasor": pulse_train(turns)}
    if told_by != "both":
        channels = {told_by: channels[told_by]}
    record = xr.Dataset(channels, coords={"time": ("time", time, {"units": "s"})})
    found = fit_turning(assign(record, machine), machine, levitated, "drop")
    assert found.omega / (2 * np.pi) == pytest.approx(np.interp(levitated, time, hz), abs=0.05)
    assert found.begin > levitated - trip - 0.05
    if told_by != "speed":
        off = (found.angle - machine.keyphasor.angle) / (2 * np.pi) - np.interp(levitated, time, turns)
        assert abs(off - round(off)) * 2 * np.pi < 4 * found.angle_sigma < np.radians(4.0)


def test_a_steady_speed_tells_from_the_first_sample_on():
    machine = load_machine(shipped("short/machine.toml"))
    time = STEP * np.arange(int(2.1 / STEP))
    for hz in (61.3, 97.0, 100.0, 100.02, 148.6):
        speed = hz + 0.03 * np.random.default_rng(1).standard_normal(len(time))
        turns = turned(np.full(len(time), hz))
        channels = {"speed": ("time", speed, {"units": "Hz"}), "keyphasor": pulse_train(turns + 0.37)}
        record = xr.Dataset(channels, coords={"time": ("time", time, {"units": "s"})})
        assert fit_turning(assign(record, machine), machine, 2.0, "drop").begin == -np.inf


def test_the_orbit_is_that_since_the_drive_has_tripped():
    """Over a second in which the angle was not known it was washed out, and stood as noise."""
    machine, short = drops.machine(), drops.drop(levitated=0.08)
    known = measured_drop(short, machine)
    before = STEP * np.arange(-20000, 0)
    hz = np.where(before < -0.4, 97.0 * np.exp(0.4 / 20.0), 97.0 * np.exp(-before / 20.0))
    angle = 2 * np.pi * (turned(np.append(hz, 97.0))[:-1] - turned(np.append(hz, 97.0))[-1])
    angle -= known.omega * (known.release - float(short.time[0]))
    time = STEP * np.arange(len(before) + short.sizes["time"])
    noise = np.random.default_rng(1)
    channels = {}
    for probe, levitated in zip(known.probes, known.noise, strict=True):
        name = machine.channel_in_file(probe.name)
        orbit = sum((c * np.exp(1j * k * angle)).real for k, c in enumerate(levitated.orders[:2], start=1))
        held = levitated.mean + orbit + drops.NOISE * noise.standard_normal(len(before))
        channels[name] = ("time", np.append(held, short[name].values), short[name].attrs)
    mark = (known.angle - machine.keyphasor.angle) / (2 * np.pi)
    key = machine.channel_in_file("keyphasor")
    channels[key] = ("time", np.append(pulse_train(angle / (2 * np.pi) + mark)[1], short[key].values), short[key].attrs)
    drop = measured_drop(xr.Dataset(channels, coords={"time": ("time", time, short.time.attrs)}), machine)
    for seen, true in zip(drop.noise, known.noise, strict=True):
        assert abs(seen.orders[0]) == pytest.approx(abs(true.orders[0]), abs=0.1e-6)
        assert seen.sigma == pytest.approx(true.sigma, rel=0.15)


@pytest.mark.parametrize("reads", [0.98, 1.003, 1.02])
@pytest.mark.parametrize("levitated", [0.1, 0.5])
def test_pulses_set_the_scale_of_a_speed_signal_that_contradicts_them(reads, levitated):
    """It outvoted them: read 2 per cent too much it put the angle 35 degrees off, of which 0.16 were owned to."""
    machine = load_machine(shipped("short/machine.toml"))
    time = STEP * np.arange(int((levitated + 0.1) / STEP))
    hz = 97.0 - 1.5 * time
    turns = turned(hz) + 0.37
    speed = reads * hz + 0.03 * np.random.default_rng(1).standard_normal(len(time))
    channels = {"speed": ("time", speed, {"units": "Hz"}), "keyphasor": pulse_train(turns)}
    record = xr.Dataset(channels, coords={"time": ("time", time, {"units": "s"})})
    found = fit_turning(assign(record, machine), machine, levitated, "drop")
    assert found.signal_over_pulses == pytest.approx(reads, abs=1e-3)
    assert found.omega / (2 * np.pi) == pytest.approx(np.interp(levitated, time, hz), abs=0.05)
    off = (found.angle - machine.keyphasor.angle) / (2 * np.pi) - np.interp(levitated, time, turns)
    assert abs(off - round(off)) * 2 * np.pi < 4 * found.angle_sigma < np.radians(2.0)


def test_a_drop_tells_by_how_much_its_speed_signal_is_wrong():
    machine, record = drops.machine(), drops.drop()
    right = measured_drop(record, machine)
    assert right.remarks == ()
    name = machine.channel_in_file("speed")
    wrong = measured_drop(record.assign({name: 1.02 * record[name]}), machine)
    assert "speed: before the release it reads 2 % more than the keyphasor counts (97.0 Hz" in wrong.remarks[0]
    assert wrong.omega == pytest.approx(right.omega, rel=5e-4)
    assert abs(wrong.angle - right.angle - right.omega * (wrong.release - right.release)) < 3 * wrong.angle_sigma


@pytest.mark.parametrize("phase", [0.3702, 0.3712, 0.3724, 0.3737])
def test_pulses_that_are_all_rounded_alike_tell_the_angle_no_better_than_one(phase):
    """At 100 Hz a turn has 200 samples: the angle was 0.7 degrees off, 11 of its standard deviations."""
    machine = load_machine(shipped("short/machine.toml"))
    time = STEP * np.arange(int(2.1 / STEP))
    turns = 100.0 * time + phase
    speed = 100.0 + 0.03 * np.random.default_rng(1).standard_normal(len(time))
    channels = {"speed": ("time", speed, {"units": "Hz"}), "keyphasor": pulse_train(turns)}
    record = xr.Dataset(channels, coords={"time": ("time", time, {"units": "s"})})
    found = fit_turning(assign(record, machine), machine, 2.0, "drop")
    off = (found.angle - machine.keyphasor.angle) / (2 * np.pi) - (200.0 + phase)
    assert abs(off - round(off)) * 2 * np.pi < 2 * found.angle_sigma < np.radians(1.2)
