"""The sensor chain: each step against what it must do to a known signal."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.errors import InputError
from tdbsim.machine import Keyphasor, load_machine
from tdbsim.modes import free_free
from tdbsim.rotor import build_rotor
from tdbsim.sensors import (
    Motion,
    ProbeChain,
    Runout,
    SensorChain,
    at_probes,
    delayed,
    drifting,
    hum,
    keyphasor_pulses,
    measure,
    projected,
    quantised,
    surface,
)

from tdbmon.record.assign import assign
from tdbmon.record.formats.netcdf import write_netcdf
from tdbmon.record.keyphasor import pulses
from tdbmon.record.read import read

MACHINE = load_machine(Path(__file__).parents[2] / "datasets" / "coastdown" / "machine.toml")
RATE = 20e3


def motion(n=4000, speed=100.0, x=0.0, y=0.0, start=0.0, machine=MACHINE):
    time = start + np.arange(n) / RATE
    probes = len(machine.probes)
    angle = machine.sense * 2 * math.pi * speed * (time - start)
    planes = [np.broadcast_to(np.asarray(each, dtype=float), (probes, n)) for each in (x, y)]
    return Motion(time, *planes, angle, np.full(n, speed))


def rng():
    return np.random.default_rng(7)


@given(st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3), st.floats(-math.pi, math.pi))
def test_projection_is_the_displacement_along_the_probe(x, y, angle):
    assert projected(x, y, angle) == pytest.approx(math.hypot(x, y) * math.cos(math.atan2(y, x) - angle), abs=1e-17)


def test_ideal_chain_reads_the_projection_at_each_probe_plane():
    planes_x = 1e-6 * np.arange(1, 5)[:, None] * np.ones(4000)
    planes_y = -2e-6 * np.arange(1, 5)[:, None] * np.ones(4000)
    record = measure(motion(x=planes_x, y=planes_y), SensorChain(), MACHINE, rng())
    for row, probe in enumerate(MACHINE.probes):
        along = (row + 1) * 1e-6 * (math.cos(probe.angle) - 2 * math.sin(probe.angle))
        np.testing.assert_allclose(record[probe.name].values, along, rtol=1e-12)


def test_modal_coordinates_at_the_probe_planes():
    modes = free_free(build_rotor(MACHINE), 2)
    a = np.zeros((modes.n, 3))
    a[0] = [1e-4, 2e-4, 3e-4]  # translation
    x, y = at_probes(MACHINE, modes, a, -a)
    expected = np.tile(a[0] / math.sqrt(modes.model.total_mass), (4, 1))
    np.testing.assert_allclose(x, expected, rtol=1e-12)
    np.testing.assert_allclose(y, -expected, rtol=1e-12)


def test_gain_offset_and_angle_error():
    chain = SensorChain(probes={"DE_A": ProbeChain(gain=1.1, offset=5e-6, angle_error=0.2)})
    record = measure(motion(x=1e-4, y=3e-5), chain, MACHINE, rng())
    angle = math.radians(45) + 0.2
    expected = 1.1 * (1e-4 * math.cos(angle) + 3e-5 * math.sin(angle)) + 5e-6
    np.testing.assert_allclose(record["DE_A"].values, expected, rtol=1e-12)
    np.testing.assert_allclose(record["NDE_A"].values, (1e-4 + 3e-5) / math.sqrt(2), rtol=1e-12)


def test_eccentric_track_looks_like_a_forward_circle():
    """First-order runout cannot be told from the shaft's centre turning with the shaft."""
    angle = np.linspace(0, 20, 500)
    for at in (0.3, 1.2, -2.0):
        seen = surface([(Runout(1, 4e-6, 0.7),)], angle, [at])[0]
        np.testing.assert_allclose(
            seen, projected(4e-6 * np.cos(angle + 0.7), 4e-6 * np.sin(angle + 0.7), at), atol=1e-18
        )


def test_oval_track_shows_twice_the_speed_and_opposite_signs_at_right_angles():
    angle = np.linspace(0, 4 * math.pi, 1000, endpoint=False)
    first, second = surface([(Runout(2, 3e-6, 0.4),)] * 2, angle, [0.5, 0.5 + math.pi / 2])
    np.testing.assert_allclose(first, -second, atol=1e-18)
    lines = np.abs(np.fft.rfft(first)) / 500
    assert lines[4] == pytest.approx(3e-6, rel=1e-9)  # two revolutions, two crests each
    assert np.delete(lines, 4).max() < 1e-15
    # the crest passes the probe when the shaft has brought it there
    assert surface([(Runout(2, 3e-6, 0.4),)], np.array([0.5 - 0.4]), [0.5])[0, 0] == pytest.approx(3e-6)


@pytest.mark.parametrize("lag", [0.0, 1.0, 0.37, 2.5, 7.0])
def test_lag_shifts_the_phase_of_a_sine(lag):
    time = np.arange(2000) / RATE
    sine = delayed(np.sin(2 * math.pi * 300 * time), lag)
    expected = np.sin(2 * math.pi * 300 * (time - lag / RATE))
    np.testing.assert_allclose(sine[20:], expected[20:], atol=3e-6)


def test_lag_holds_the_first_value_and_an_advance_the_last():
    ramp = np.arange(10.0)
    np.testing.assert_array_equal(delayed(ramp, 3.0), [0, 0, 0, 0, 1, 2, 3, 4, 5, 6])
    np.testing.assert_allclose(delayed(ramp, -2.5), [2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9, 9, 9], atol=1e-12)


def test_lag_delays_one_channel_against_the_others():
    time = np.arange(4000) / RATE
    wave = 1e-4 * np.sin(2 * math.pi * 137 * time)
    record = measure(motion(x=wave), SensorChain(probes={"NDE_B": ProbeChain(lag=3.0)}), MACHINE, rng())
    np.testing.assert_allclose(record["NDE_B"].values[3:], -record["NDE_A"].values[:-3], atol=1e-18)


@pytest.mark.parametrize("leaks", [{"NDE_C": ("NDE_A", 0.2)}, {"NDE_B": ("NDE_C", 0.2)}], ids=["into", "from"])
def test_a_leak_of_a_probe_that_is_not_there_is_refused(leaks):
    with pytest.raises(InputError, match="'NDE_C' is no probe of this machine; did you mean"):
        measure(motion(), SensorChain(leaks=leaks), MACHINE, rng())


@pytest.mark.parametrize(("count", "says"), [(1, "one pulse a revolution"), (4, "4 pulses a revolution")])
def test_a_keyphasor_channel_says_its_pulses(count, says):
    toothed = MACHINE.model_copy(update={"keyphasor": Keyphasor(channel="keyphasor", pulses_per_revolution=count)})
    assert measure(motion(), SensorChain(), toothed, rng())["keyphasor"].attrs["long_name"] == says


def test_what_leaks_into_a_late_channel_is_late_too():
    time = np.arange(4000) / RATE
    wave = 1e-4 * np.sin(2 * math.pi * 137 * time)
    chain = SensorChain(probes={"NDE_B": ProbeChain(lag=3.0)}, leaks={"NDE_B": ("NDE_A", 0.2)})
    record = measure(motion(x=wave), chain, MACHINE, rng())
    np.testing.assert_allclose(record["NDE_B"].values[3:], -0.8 * record["NDE_A"].values[:-3], atol=1e-18)


def test_hum_has_mains_frequency_and_amplitude():
    machine = MACHINE.model_copy(update={"mains": 60.0})
    chain = SensorChain(ProbeChain(hum=2e-6, hum_phase=0.3))
    record = measure(motion(), chain, machine, rng())  # 0.2 s: twelve periods
    lines = np.fft.rfft(record["DE_B"].values) / 2000
    assert np.argmax(np.abs(lines)) == 12
    assert np.abs(lines[12]) == pytest.approx(2e-6, rel=1e-9)
    assert np.angle(lines[12]) == pytest.approx(0.3, abs=1e-9)
    np.testing.assert_allclose(hum(np.array([0.0, 1 / 60]), 60.0, 2e-6), 2e-6)


def test_converter_has_steps_of_its_full_scale_over_32768_and_clips():
    step = 1e-3 / 32768
    values = np.array([0.0, 0.49 * step, 0.51 * step, -1.4 * step, 2e-3, -2e-3])
    np.testing.assert_allclose(quantised(values, 1e-3) / step, [0, 0, 1, -1, 32767, -32768], rtol=1e-12)
    np.testing.assert_array_equal(quantised(values, math.inf), values)


@given(st.floats(-0.99e-3, 0.99e-3), st.floats(1e-3, 5e-3))
def test_converter_is_within_half_a_step(value, full_scale):
    assert abs(quantised(value, full_scale) - value) <= 0.5000001 * full_scale / 32768


def test_packed_channel_keeps_its_codes(tmp_path):
    chain = SensorChain(ProbeChain(noise=1e-6, full_scale=1e-3))
    record = measure(motion(x=3e-4), chain, MACHINE, rng())
    array = record["NDE_A"]
    assert array.attrs["full_scale"] == pytest.approx([-1e-3, 1e-3 * 32767 / 32768])
    write_netcdf(record, tmp_path / "drop.nc")
    import netCDF4

    with netCDF4.Dataset(tmp_path / "drop.nc") as file:
        assert file["NDE_A"].dtype == np.int16
    again = read(tmp_path / "drop.nc")
    for name in record.data_vars:
        np.testing.assert_array_equal(again[name].values, record[name].values)
        assert again[name].attrs["units"] == record[name].attrs["units"]
    assert again["NDE_A"].attrs["full_scale"] == array.attrs["full_scale"]


def test_white_noise_has_its_deviation_and_no_memory():
    record = measure(motion(n=100_000), SensorChain(ProbeChain(noise=2e-6)), MACHINE, rng())
    noise = record["NDE_A"].values
    assert noise.std() == pytest.approx(2e-6, rel=0.01)  # four standard errors
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4 / math.sqrt(100_000)
    other = record["NDE_B"].values
    assert abs(np.corrcoef(noise, other)[0, 1]) < 4 / math.sqrt(100_000)


def test_drift_is_stationary_with_its_correlation_time():
    runs = np.array([drifting(400, 1e-3, 3.0, 0.02, np.random.default_rng(seed)) for seed in range(4000)])
    np.testing.assert_allclose(runs.std(axis=0)[[0, 1, 50, 399]], 3.0, rtol=0.05)  # from the first sample on
    correlation = np.mean(runs[:, 100] * runs[:, 120]) / 9
    assert correlation == pytest.approx(math.exp(-1), abs=0.06)


def test_noise_of_one_channel_leaves_the_others():
    quiet = SensorChain(ProbeChain(noise=1e-6), speed_noise_hz=0.1)
    loud = replace(quiet, probes={"NDE_A": ProbeChain(noise=1e-6, drift=1e-5)})
    first, second = (measure(motion(), chain, MACHINE, rng()) for chain in (quiet, loud))
    assert not np.array_equal(first["NDE_A"], second["NDE_A"])
    for name in ("NDE_B", "DE_A", "DE_B", "speed"):
        np.testing.assert_array_equal(first[name], second[name])


def test_speed_signal_has_its_noise():
    record = measure(motion(n=40_000), SensorChain(speed_noise_hz=0.05), MACHINE, rng())
    assert record["speed"].values.mean() == pytest.approx(100.0, abs=0.001)
    assert record["speed"].values.std() == pytest.approx(0.05, rel=0.02)


@pytest.mark.parametrize("rotation", ["ccw", "cw"])
@pytest.mark.parametrize("edge", ["rising", "falling"])
@pytest.mark.parametrize("mark", [0.0, 1.0])
def test_keyphasor_edge_comes_when_the_shaft_passes_its_angle(rotation, edge, mark):
    machine = MACHINE.model_copy(
        update={"rotation": rotation, "keyphasor": Keyphasor(channel="keyphasor", edge=edge, angle=mark)}
    )
    turned = machine.sense * np.linspace(0.1, 31.0, 200_001)
    level = keyphasor_pulses(turned, machine, 0.05)
    jump = np.diff(level)
    edges = turned[1:][jump > 0] if edge == "rising" else turned[1:][jump < 0]
    off_mark = np.angle(np.exp(1j * (edges - mark)))
    assert len(edges) in (4, 5)
    assert np.all(np.abs(off_mark) < 2e-4)  # the step of the angle
    assert np.all(off_mark * machine.sense >= 0)
    assert np.mean(level) == pytest.approx(0.05 if edge == "rising" else 0.95, abs=0.01)


def test_keyphasor_of_angle_zero():
    assert keyphasor_pulses(np.array([0.0, 0.01, -0.01, 1.0]), MACHINE, 0.05).tolist() == [1, 1, 0, 0]


@pytest.mark.parametrize("rotation", ["ccw", "cw"])
@pytest.mark.parametrize("trembles", [1e-24, 1e-4])
def test_a_shaft_that_stands_at_its_mark_gives_no_pulses(rotation, trembles):
    machine = MACHINE.model_copy(update={"rotation": rotation})
    turned = trembles * np.random.default_rng(0).standard_normal(4000)
    turned[0] = 0.0
    assert np.ptp(keyphasor_pulses(turned, machine, 0.03)) == 0


@pytest.mark.parametrize("turns", [2.25, -2.25])
def test_a_shaft_that_creeps_gives_a_pulse_a_turn_to_either_side_however_it_trembles(turns):
    turned = 2 * np.pi * (0.5 + turns * np.linspace(0, 1, 40_001))
    turned += 1e-5 * np.random.default_rng(0).standard_normal(40_001)
    assert np.count_nonzero(np.diff(keyphasor_pulses(turned, MACHINE, 0.03))) == 4


def test_record_has_the_form_of_a_measured_one():
    chain = SensorChain(ProbeChain(noise=1e-7, full_scale=1e-3), speed_noise_hz=0.02)
    mapped = MACHINE.model_copy(update={"channels": {"NDE_A": "Ch 1"}})
    record = measure(motion(start=3.0), chain, mapped, rng(), title="Synthetic drop from 100 Hz")
    assert set(record.data_vars) == {"Ch 1", "NDE_B", "DE_A", "DE_B", "speed", "keyphasor"}
    assert record["time"].values[0] == 0
    assert record["time"].attrs["units"] == "s"
    assert {name: array.attrs["units"] for name, array in record.data_vars.items()} == {
        "Ch 1": "m", "NDE_B": "m", "DE_A": "m", "DE_B": "m", "speed": "Hz", "keyphasor": "1",
    }  # fmt: skip
    assert all(array.dims == ("time",) and array.dtype == np.float64 for array in record.data_vars.values())
    assert record.attrs["title"] == "Synthetic drop from 100 Hz"


def test_records_reader_finds_probes_and_pulses():
    circle = motion(n=8000, speed=150.0)
    circle = replace(
        circle, x=1e-4 * np.cos(circle.angle) * np.ones((4, 1)), y=1e-4 * np.sin(circle.angle) * np.ones((4, 1))
    )
    laid = assign(measure(circle, SensorChain(), MACHINE, rng()), MACHINE)
    found = pulses(laid, MACHINE)
    assert len(found.times) >= 58
    np.testing.assert_allclose(found.times * 150.0 - np.rint(found.times * 150.0), 0, atol=150 / RATE)
    # the probe at 45 deg has its high spot an eighth of a revolution after the mark
    high = laid["time"].values[np.argmax(laid["NDE_A"].values[:133])]
    assert high * 150.0 == pytest.approx(1 / 8, abs=150 / RATE)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ProbeChain(noise=-1e-6), "noise -1e-06 m"),
        (lambda: ProbeChain(full_scale=0.0), "full scale"),
        (lambda: ProbeChain(drift_time=0.0), "drift_time"),
        (lambda: ProbeChain(lag=math.nan), "lag"),
        (lambda: SensorChain(speed_noise_hz=-1.0), "speed noise"),
        (lambda: SensorChain(keyphasor_width=1.5), "keyphasor width"),
        (lambda: measure(motion(), SensorChain(probes={"NDEA": ProbeChain()}), MACHINE, rng()), "did you mean 'NDE_A'"),
        (
            lambda: measure(
                replace(motion(), x=np.zeros((3, 4000)), y=np.zeros((3, 4000))), SensorChain(), MACHINE, rng()
            ),
            "3 probe",
        ),
        (lambda: measure(replace(motion(), time=np.arange(4000.0) ** 2), SensorChain(), MACHINE, rng()), "evenly"),
        (lambda: measure(motion(n=1), SensorChain(), MACHINE, rng()), "at least two"),
        (lambda: motion(x=math.nan), "finite"),
        (lambda: Motion(np.arange(3.0), np.zeros((2, 3)), np.zeros((4, 3)), np.zeros(3), np.zeros(3)), "both"),
    ],
)
def test_what_makes_no_record_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
