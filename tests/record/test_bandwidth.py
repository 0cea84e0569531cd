"""Displacement channels behind a low-pass are told, and no sound ones."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter
from tdbsim.machine import load_machine

from tdbmon.record.assign import assign
from tdbmon.record.bandwidth import check_bandwidth
from tdbmon.record.read import read
from tdbmon.shipped import shipped

PROBES = ("NDE_A", "NDE_B", "DE_A", "DE_B")
RECORDS = ("coastdown/drop_100", "coastdown/drop_150", "short/drop_060", "short/drop_210", "loose/drop_060")


def laid(name):
    machine = load_machine(shipped(f"{name.split('/')[0]}/machine.toml"))
    return assign(read(shipped(f"{name}.nc")), machine).load(), machine


def changed(record, change):
    """The record with readings (n,), m, at times (n,), s, changed."""
    out = record.copy()
    for name in PROBES:
        time = record[record[name].dims[0]].values
        out[name] = record[name].copy(data=change(time, record[name].values))
    return out


@pytest.mark.parametrize("name", RECORDS)
@pytest.mark.parametrize(("order", "corner_hz"), [(2, 200.0), (4, 500.0)])
def test_a_low_pass_is_told(name, order, corner_hz):
    record, machine = laid(name)

    def low_pass(time, values):
        b, a = butter(order, corner_hz, fs=1 / (time[1] - time[0]))
        return values[0] + lfilter(b, a, values - values[0])

    (row,) = check_bandwidth(changed(record, low_pass), machine)
    assert not row.passed
    assert "4 of 4 displacement channels" in row.detail and "It delays release and contacts" in row.detail


@pytest.mark.parametrize("name", RECORDS)
def test_a_shaft_that_its_bearings_shake_more_at_low_frequencies_passes(name):
    """Noise a hundred times as great at some hundred hertz as at some kilohertz, as behind a control loop."""
    record, machine = laid(name)
    rng = np.random.default_rng(1)

    def shaken(time, values):
        b, a = butter(1, 200.0, fs=1 / (time[1] - time[0]))
        return values + 30 * np.std(np.diff(values[:100])) * lfilter(b, a, rng.normal(size=values.size))

    assert not check_bandwidth(changed(record, shaken), machine)


@pytest.mark.parametrize("name", RECORDS)
def test_a_sound_channel_passes_however_wide_its_orbit(name):
    record, machine = laid(name)
    for size in (0.0, 20e-6, 90e-6):
        whirls = changed(record, lambda time, values, a=size: values + a * np.cos(2 * np.pi * 93.0 * time))
        assert not check_bandwidth(whirls, machine)
