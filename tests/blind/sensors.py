"""From the shaft's motion to the file's channels: probes with runout, noise, hum and 16 bits; keyphasor; speed signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.blind.machine import Machine
from tests.blind.truth import LEAD, LEVITATED, RATE, Drop

Array = NDArray[np.float64]

FULL_SCALE = 1e-3  # m
MARK_WIDTH = 0.22  # rad of the keyphasor's pulse


@dataclass(frozen=True)
class Sensors:
    """The instruments; everything from `zero` on is off at its default.  Probes in the machine's order, ends 0 and 1."""

    noise: float  # m
    noise_memory: float  # correlation from sample to sample
    hum: float  # m
    runout: tuple[tuple[complex, complex, complex], ...]  # of each end: 1X, 2X, 3X in the shaft's frame, m
    speed_noise: float  # Hz
    zero: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # reading at the bearing's centre, m
    gain: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    turned: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # angle errors, rad
    late: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # s
    leak: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # of the end's other probe into this one
    drift: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # m, reached slowly from the release on
    drift_time: float = 0.2
    float_end: int = 0  # an end whose probes see a cone while the rotor moves axially
    float_amplitude: float = 0.0  # m
    float_frequency: float = 10.0
    float_time: float = 0.3


@dataclass(frozen=True)
class Channels:
    """Channels of a file: probes in m (samples, 4), pulses 0 or 1, speed in Hz."""

    probes: Array
    keyphasor: NDArray[np.int8]
    speed: Array


def read(
    drop: Drop,
    machine: Machine,
    sensors: Sensors,
    mark: float,
    rng: np.random.Generator,
    *,
    levitated: int = LEVITATED,
    rounded: bool = True,
) -> Channels:
    """Return the channels of a drop.

    `mark` is the angle of the keyphasor's mark on the shaft, rad (0 as on the drawing); `levitated` as in the drop's run;
    `rounded`: quantise to 16 bits.
    """
    whole = len(drop.angle)
    time = (np.arange(whole) - LEAD) / RATE
    released = np.maximum(time - levitated / RATE, 0.0)
    seen = np.empty((whole, 4))
    for p, probe in enumerate(machine.probes):
        axis = np.radians(probe.angle) + sensors.turned[p]
        end = p // 2
        seen[:, p] = drop.places[:, p, 0] * np.cos(axis) + drop.places[:, p, 1] * np.sin(axis)
        facing = axis - drop.angle  # the point of the surface under the probe
        for order, amplitude in enumerate(sensors.runout[end], start=1):
            seen[:, p] += (amplitude * np.exp(1j * order * facing)).real
        if end == sensors.float_end and sensors.float_amplitude:
            swing = np.sin(2 * np.pi * sensors.float_frequency * released) * np.exp(-released / sensors.float_time)
            seen[:, p] += sensors.float_amplitude * swing
    other = seen[:, [1, 0, 3, 2]]
    seen = np.array(sensors.gain) * seen + np.array(sensors.leak) * other
    seen += np.array(sensors.zero) + np.array(sensors.drift) * (1 - np.exp(-released / sensors.drift_time))[:, None]
    for p, delay in enumerate(sensors.late):
        if delay:
            seen[:, p] = np.interp(time - delay, time, seen[:, p])
    seen, time = seen[LEAD:], time[LEAD:]

    rough = rng.standard_normal(seen.shape)
    if sensors.noise_memory:
        rough = lfilter([np.sqrt(1 - sensors.noise_memory**2)], [1.0, -sensors.noise_memory], rough, axis=0)
    phase = rng.uniform(0, 2 * np.pi) + rng.normal(0, 0.2, 4)
    seen = seen + sensors.noise * rough + sensors.hum * np.sin(2 * np.pi * 50 * time[:, None] + phase)
    step = FULL_SCALE / 32768
    if rounded:
        seen = np.clip(np.round(seen / step), -32768, 32767) * step

    pulse = np.mod(drop.angle[LEAD:] - mark, 2 * np.pi) < MARK_WIDTH
    speed = drop.speed[LEAD:] / (2 * np.pi) + sensors.speed_noise * rng.standard_normal(len(time))
    return Channels(seen, pulse.astype(np.int8), speed)
