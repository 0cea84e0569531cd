"""How the shaft turns before the release, by its speed signal and keyphasor."""

import numpy as np
import pytest
import xarray as xr
from tdbsim.machine import load_machine

from tdbmon.identify.turning import fit_turning
from tdbmon.record.assign import assign
from tdbmon.shipped import shipped

RELEASE, HZ, SLOWS = 0.4, 97.0, -7.0  # s, Hz, Hz/s


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
