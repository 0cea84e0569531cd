"""A drop of one end alone: a rigid rotor whose other magnetic bearing holds, integrated step by step, without the simulator."""

from __future__ import annotations

import numpy as np
import xarray as xr

RELEASE_S = 0.1
RATE_HZ, STEPS = 10_000, 4
SPEED_HZ = 120.0
HOLDS, DAMPS = 4e6, 4e3  # of a magnetic bearing, N/m and N s/m
RING, RING_DAMPS = 3.5e7, 4e3
GAP = 250e-6
NOISE = 0.25e-6


def held_drop(machine, rotor, held, seconds=0.6):
    """Return a record, laid over the machine, of a drop of which the magnetic bearing of the end `held` takes no part.

    The displacement at each end's bearing plane, (time, end) as x + i y in m, is beside it.
    """
    mass, inertia = rotor.total_mass, rotor.diametral_inertia
    magnets = {b.name: b.position - rotor.centre_of_mass for b in machine.magnetic_bearings}
    (a, b) = magnets.values()
    carries = dict(zip(magnets, (mass * 9.80665 * b / (b - a), -mass * 9.80665 * a / (b - a)), strict=True))
    rings = [each.position - rotor.centre_of_mass for each in machine.touchdown_bearings]
    omega = 2 * np.pi * SPEED_HZ
    dt = 1 / RATE_HZ / STEPS
    q, v = np.zeros(2, complex), np.zeros(2, complex)  # translation, tilt
    warm = round(1.0 * RATE_HZ)
    path = np.zeros((round(seconds * RATE_HZ), 2), complex)
    for i in range(-warm, len(path)):
        if i >= 0:
            path[i] = q
        for step in range(STEPS):
            t = i / RATE_HZ + step * dt
            pushed = [
                (-1j * mass * 9.80665, 0.0),
                (40e-6 * omega**2 * np.exp(1j * omega * t), 0.335 - rotor.centre_of_mass),
            ]
            for name, z in magnets.items():
                if name == held or t < RELEASE_S:
                    pushed.append((1j * carries[name] - HOLDS * (q[0] + z * q[1]) - DAMPS * (v[0] + z * v[1]), z))
            for z in rings:
                at, to = q[0] + z * q[1], v[0] + z * v[1]
                if abs(at) > GAP:
                    out = at / abs(at)
                    press = max(RING * (abs(at) - GAP) + RING_DAMPS * (to * out.conjugate()).real, 0.0)
                    pushed.append((-press * out * (1 + 0.1j), z))  # the rings hardly drag
            v = v + dt * np.array([sum(f for f, _ in pushed) / mass, sum(f * z for f, z in pushed) / inertia])
            q = q + dt * v
    return _record(machine, rotor, path), path @ np.array([[1.0, 1.0], rings])


def _record(machine, rotor, path):
    rng = np.random.default_rng(1)
    time = np.arange(len(path)) / RATE_HZ
    ds = xr.Dataset(coords={"time": ("time", time, {"units": "s"})}, attrs={"source_file": "held"})
    for probe in machine.probes:
        z = path[:, 0] + (probe.position - rotor.centre_of_mass) * path[:, 1]
        reading = (z * np.exp(-1j * probe.angle)).real + rng.normal(0, NOISE, len(time))
        ds[probe.name] = ("time", reading, {"units": "m"})
    ds["speed"] = ("time", np.full(len(time), SPEED_HZ) + rng.normal(0, 0.05, len(time)), {"units": "Hz"})
    turned = SPEED_HZ * time
    ds["keyphasor"] = ("time", ((turned % 1) < 0.1).astype("i1"), {"units": "1"})
    return ds
