"""The sensor chain: from the motion of the shaft to the channels of a record.

In the order of the chain: geometry (probe plane and angle), surface (runout), electronics (gain, offset), crosstalk from a
neighbouring channel, sampling (lag, of crosstalk too), disturbances on the cables (hum, noise), and the converter (16 bit, with
clipping).  Each step is a pure function on arrays; `measure` runs them all and returns a record in the form into which measured
files are read: channels as in the file, SI, on the dimension ``time`` counted from the first sample.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError, did_you_mean
from tdbsim.machine import Machine, Probe
from tdbsim.modes import Modes
from tdbsim.slow_roll import slow_roll

Array = NDArray[np.float64]

_CODES = np.iinfo(np.int16)
_PULSE = 0.03  # of the pulse spacing: width of a usual mark
_PLAY = 1e-3  # of the pulse spacing: hysteresis of the trigger, so that a trembling shaft gives no pulses
_PULSE_SAMPLES = 3  # least width of a pulse in samples: a narrower one may fall between samples
_FEWEST_SAMPLES = 4  # from pulse to pulse, two per level; with fewer, pulses are lost
_GOOD_SAMPLES = 8  # from pulse to pulse; with four, intervals round to 3 and 5, which looks like missed pulses


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion seen by the sensors, at the sampling instants of the record.

    Attributes
    ----------
    time : (n,) array
        s.
    x, y : (probes, n) arrays
        Displacement of the shaft's centre in the plane of each of the machine's probes, in their order, m.
    angle : (n,) array
        Shaft angle from +x towards +y, rad, unwrapped; decreasing for clockwise rotation.
    speed_hz : (n,) array
        Speed, Hz, positive.
    """

    time: Array
    x: Array
    y: Array
    angle: Array
    speed_hz: Array

    def __post_init__(self) -> None:
        n = len(self.time)
        for name in ("x", "y", "angle", "speed_hz"):
            values = getattr(self, name)
            if values.shape[-1:] != (n,) or not np.all(np.isfinite(values)):
                raise InputError(
                    f"motion: {name} of shape {values.shape} does not hold {n} finite samples, as time does"
                )
        if self.x.ndim != 2 or self.x.shape != self.y.shape:
            raise InputError(f"motion: x {self.x.shape} and y {self.y.shape} must both be (probes, samples)")


@dataclass(frozen=True)
class Runout:
    """One harmonic of the shaft's surface in a probe plane, the same for all probes in that plane.

    Its radial deviation is ``amplitude cos(order (beta - phase))``, with beta measured on the shaft, from the mark that is at +x
    at shaft angle 0, in the sense from +x towards +y.

    Attributes
    ----------
    order : int
        1 for an eccentric track, 2 for an oval one.
    amplitude : float
        m, 0-pk.
    phase : float
        Angle of a crest on the shaft, rad.
    """

    order: int
    amplitude: float
    phase: float = 0.0


@dataclass(frozen=True)
class ProbeChain:
    """Errors of a displacement channel; by default none.

    Attributes
    ----------
    gain : float
        Reading over displacement.
    offset : float
        Added after the gain, m.
    angle_error : float
        True angle less the machine file's, rad.
    runout : tuple of Runout
        Of the surface under the probe.
    lag : float
        Delay in samples, possibly fractional.
    hum, hum_phase : float
        0-pk amplitude, m, and phase, rad, at mains frequency.
    noise : float
        Standard deviation of white noise, m.
    drift, drift_time : float
        Standard deviation, m, and correlation time, s, of first-order autoregressive noise.
    full_scale : float
        Displacement at the 16-bit converter's greatest code, m; infinite for no quantisation.

    Raises
    ------
    InputError
        If a value is negative or not finite where that is impossible.
    """

    gain: float = 1.0
    offset: float = 0.0
    angle_error: float = 0.0
    runout: tuple[Runout, ...] = ()
    lag: float = 0.0
    hum: float = 0.0
    hum_phase: float = 0.0
    noise: float = 0.0
    drift: float = 0.0
    drift_time: float = 0.01
    full_scale: float = math.inf

    def __post_init__(self) -> None:
        for name in ("hum", "noise", "drift"):
            if not 0 <= (value := getattr(self, name)) < math.inf:
                raise InputError(f"sensor chain: {name} {value:g} m is not a valid amplitude; give 0 or more")
        for name in ("gain", "offset", "angle_error", "lag", "hum_phase"):
            if not math.isfinite(value := getattr(self, name)):
                raise InputError(f"sensor chain: {name} {value:g} is not finite")
        if not self.full_scale > 0:
            raise InputError(f"sensor chain: full scale {self.full_scale:g} m is not positive")
        if not 0 < self.drift_time < math.inf:
            raise InputError(f"sensor chain: drift_time {self.drift_time:g} s is not positive and finite")


@dataclass(frozen=True)
class SensorChain:
    """The sensors of a machine.

    Attributes
    ----------
    probe : ProbeChain
        Of every probe that is not in `probes`.
    probes : mapping
        Probe name to its own `ProbeChain`.
    leaks : mapping
        Crosstalk: probe name to the source probe and the fraction of its reading that is added.
    speed_noise_hz : float
        Standard deviation of the speed signal's white noise, Hz.
    keyphasor_width : float, optional
        Width of a keyphasor pulse over the pulse spacing; by default that of a usual mark, or more where the sampling would
        miss it.
    """

    probe: ProbeChain = ProbeChain()
    probes: Mapping[str, ProbeChain] = field(default_factory=dict)
    leaks: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    speed_noise_hz: float = 0.0
    keyphasor_width: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.speed_noise_hz < math.inf:
            raise InputError(f"sensor chain: speed noise {self.speed_noise_hz:g} Hz is not a valid amplitude; give 0 or more")
        if self.keyphasor_width is not None and not 0 < self.keyphasor_width < 1:
            raise InputError(f"sensor chain: keyphasor width {self.keyphasor_width:g} is not between 0 and 1 pulse spacing")

    def of(self, probe: str) -> ProbeChain:
        """Return the chain of a probe."""
        return self.probes.get(probe, self.probe)


def at_probes(machine: Machine, modes: Modes, a: Array, b: Array) -> tuple[Array, Array]:
    """Return x and y (probes, n) in the probe planes from the modal coordinates a (x) and b (y), each (modes, n)."""
    shapes = modes.at([probe.position for probe in machine.probes])
    return shapes @ a, shapes @ b


def projected(x: ArrayLike, y: ArrayLike, angle: ArrayLike) -> Array:
    """Return the displacement along a probe's axis at `angle` from +x towards +y."""
    return np.asarray(x) * np.cos(angle) + np.asarray(y) * np.sin(angle)


def surface(harmonics: Sequence[Sequence[Runout]], shaft_angle: Array, probe_angles: ArrayLike) -> Array:
    """Return the radial deviation of the shaft's surface under probes (..., probes, n), m, added to the displacement.

    Parameters
    ----------
    harmonics : sequence of sequence of Runout
        Harmonics under each probe.
    shaft_angle : (..., n) array
        rad.
    probe_angles : (probes,) array
        rad.
    """
    orders = sorted({each.order for seen in harmonics for each in seen})
    crests = np.zeros((len(harmonics), len(orders)), dtype=complex)
    for row, (seen, angle) in enumerate(zip(harmonics, np.asarray(probe_angles, dtype=float), strict=True)):
        for each in seen:
            crests[row, orders.index(each.order)] += cmath.rect(each.amplitude, each.order * (angle - each.phase))
    turned = np.array(orders)[:, None] * shaft_angle[..., None, :]
    return np.asarray(crests.real @ np.cos(turned) + crests.imag @ np.sin(turned))


def delayed(values: Array, lag: float) -> Array:
    """Return evenly sampled values (..., n) delayed by `lag` samples (cubic spline; constant beyond the ends)."""
    if lag == 0:
        return values
    last = values.shape[-1] - 1
    wanted = np.clip(np.arange(last + 1) - lag, 0, last)
    if float(lag).is_integer():
        return np.asarray(values[..., wanted.astype(int)])
    from scipy.interpolate import make_interp_spline

    return np.asarray(make_interp_spline(np.arange(last + 1), values, k=min(3, last), axis=-1)(wanted))


def clean_readings(
    x: Array, y: Array, shaft_angle: Array, probes: Sequence[Probe], chain: SensorChain, runout: ArrayLike = 0.0
) -> NDArray[np.float64]:
    """Return the readings of probes before hum, noise and converter (..., probes, n), m.

    Parameters
    ----------
    x, y : (..., probes, n) arrays
        Displacement of the shaft's centre in each probe's plane, m.
    shaft_angle : (..., n) array
        rad.
    probes : sequence of Probe
        One row each; crosstalk from a probe that is not among them is left out.
    chain : SensorChain
    runout : (..., probes, n) array
        Runout in addition to the chain's, m.
    """
    links = [chain.of(probe.name) for probe in probes]
    axes = np.array([probe.angle + link.angle_error for probe, link in zip(probes, links, strict=True)])[:, None]
    out = projected(x, y, axes) + np.asarray(runout)
    if any(link.runout for link in links):
        out += surface([link.runout for link in links], shaft_angle, axes[:, 0])
    out *= np.array([link.gain for link in links])[:, None]
    out += np.array([link.offset for link in links])[:, None]
    if chain.leaks:
        rows = {probe.name: row for row, probe in enumerate(probes)}
        alone = out.copy()
        for name, (source, part) in chain.leaks.items():
            if name in rows and source in rows:
                out[..., rows[name], :] += part * alone[..., rows[source], :]
    for row, link in enumerate(links):
        if link.lag:
            out[..., row, :] = delayed(out[..., row, :], link.lag)
    return out


def hum(time: Array, frequency_hz: float, amplitude: float, phase: float = 0.0) -> Array:
    """Return mains hum, ``amplitude cos(2 pi f t + phase)``."""
    return amplitude * np.cos(2 * math.pi * frequency_hz * time + phase)


def drifting(n: int, interval: float, deviation: float, correlation_time: float, rng: np.random.Generator) -> Array:
    """Return stationary first-order autoregressive noise (n,), a sampled Ornstein-Uhlenbeck process.

    Parameters
    ----------
    n : int
        Samples.
    interval : float
        Between samples, s.
    deviation : float
        Standard deviation.
    correlation_time : float
        Time in which the correlation falls to 1/e, s.
    rng : numpy.random.Generator
        Source of n normal numbers.
    """
    from scipy.signal import lfilter

    memory = math.exp(-interval / correlation_time)
    white = rng.standard_normal(n)
    white[1:] *= math.sqrt(1 - memory**2)  # the first one is drawn from the stationary distribution
    return deviation * np.asarray(lfilter([1.0], [1.0, -memory], white))


def quantised(values: ArrayLike, full_scale: float) -> Array:
    """Return values quantised by a 16-bit converter of range +-full_scale: steps of full_scale/32768, clipped."""
    if math.isinf(full_scale):
        return np.asarray(values, dtype=float)
    step = full_scale / -_CODES.min
    return np.clip(np.rint(np.asarray(values) / step), _CODES.min, _CODES.max) * step


def since_mark(shaft_angle: Array, machine: Machine) -> Array:
    """Return the angle turned by the shaft in its sense of rotation, rad, since its mark passed the keyphasor's `angle`."""
    return machine.sense * (shaft_angle - (machine.keyphasor.angle if machine.keyphasor else 0.0))


def keyphasor_pulses(shaft_angle: Array, machine: Machine, width: float) -> Array:
    """Return the keyphasor's level, 0 or 1, for shaft angles (rad, from +x towards +y).

    The edge named in the machine file occurs where the shaft, in its sense of rotation, passes the keyphasor's `angle`; further
    pulses per revolution are evenly spaced.  `width` is the width of a pulse over the spacing.  The trigger has some hysteresis,
    so a shaft that trembles at its mark at standstill gives no pulses.
    """
    mark = machine.keyphasor
    since = since_mark(shaft_angle, machine) / (2 * math.pi)
    since = since * (mark.pulses_per_revolution if mark else 1)
    if np.any(np.diff(since) < 0):
        since = np.array(list(accumulate(since.tolist(), lambda held, now: min(max(held, now), now + _PLAY))))
    pulse = np.where(since - np.floor(since) < width, 1.0, 0.0)
    return 1.0 - pulse if mark is not None and mark.edge == "falling" else pulse


def pulse_rate(machine: Machine, speed_hz: float) -> float:
    """Return the pulse rate of the machine's keyphasor at a speed, Hz; 0 without one."""
    return abs(speed_hz) * machine.keyphasor.pulses_per_revolution if machine.keyphasor else 0.0


def least_sampling(machine: Machine, speed_hz: float) -> float:
    """Return the least sampling rate, Hz, that resolves the keyphasor's pulses well; 0 without a keyphasor."""
    return _GOOD_SAMPLES * pulse_rate(machine, speed_hz)


def check_pulses(machine: Machine, chain: SensorChain, speed_hz: float, sampling: float) -> None:
    """Raise InputError where a sampling rate, Hz, does not resolve the keyphasor's pulses at a speed.

    A chain with a stated pulse width is not checked.
    """
    rate = pulse_rate(machine, speed_hz)
    if (
        machine.keyphasor is None
        or chain.keyphasor_width is not None
        or sampling >= _FEWEST_SAMPLES * rate * (1 - 1e-9)
    ):
        return
    count = machine.keyphasor.pulses_per_revolution
    raise InputError(
        f"keyphasor: {count} pulse{'s' if count > 1 else ''} per revolution at {speed_hz:g} Hz are"
        f" {rate:g} per second, which {sampling:g} samples per second do not resolve; sample at"
        f" {least_sampling(machine, speed_hz):g} Hz or faster"
    )


def _pulse_width(machine: Machine, speed_hz: float, interval: float) -> float:
    return min(max(_PULSE, _PULSE_SAMPLES * pulse_rate(machine, speed_hz) * interval), 0.5)


def measure(
    motion: Motion, chain: SensorChain, machine: Machine, rng: np.random.Generator, title: str = "Synthetic record"
) -> xr.Dataset:
    """Return the record of a motion by the machine's sensors.

    Parameters
    ----------
    motion : Motion
        At the record's evenly spaced sampling instants.
    chain : SensorChain
        Errors of the sensors.
    machine : Machine
        Its probes, speed and keyphasor channels, mains frequency and sense of rotation.
    rng : numpy.random.Generator
        Source of all noise.  Each channel has its own stream, so that a change of one does not affect the others.
    title : str
        Of the record.

    Returns
    -------
    xarray.Dataset
        Channels by their names in the machine's files: probes in m (as 16-bit codes in the packing that a file keeps),
        ``speed`` in Hz and ``keyphasor`` of levels 0 and 1 where the machine has them; `time` from 0 in s.

    Raises
    ------
    InputError
        If the chain names a probe that the machine lacks, the motion has another number of probes, or fewer than two or
        unevenly spaced samples.
    """
    names = [probe.name for probe in machine.probes]
    for name in (*chain.probes, *chain.leaks, *(source for source, _ in chain.leaks.values())):
        if name not in names:
            raise InputError(f"sensor chain: '{name}' is no probe of this machine{did_you_mean(name, names)}")
    if len(motion.x) != len(names):
        raise InputError(f"motion: {len(motion.x)} probe planes given, the machine has {len(names)} probes")
    interval = _interval(motion.time)
    time = motion.time - motion.time[0]
    streams = rng.spawn(len(names) + 1)
    data: dict[str, xr.DataArray] = {}
    clean = clean_readings(motion.x, motion.y, motion.angle, machine.probes, chain)
    turned = since_mark(motion.angle, machine)
    for row, probe, stream in zip(clean, machine.probes, streams[1:], strict=True):
        link = chain.of(probe.name)
        seen = row + slow_roll(probe, turned) + hum(time, machine.mains, link.hum, link.hum_phase)
        if link.noise:
            seen = seen + link.noise * stream.standard_normal(len(time))
        if link.drift:
            seen = seen + drifting(len(time), interval, link.drift, link.drift_time, stream)
        data[machine.channel_in_file(probe.name)] = _displacement(seen, link.full_scale, probe.name)
    if machine.speed is not None:
        speed = motion.speed_hz + chain.speed_noise_hz * streams[0].standard_normal(len(time))
        data[machine.channel_in_file("speed")] = _channel(speed, "Hz", "rotor speed")
    if machine.keyphasor is not None:
        width = chain.keyphasor_width or _pulse_width(machine, float(motion.speed_hz.max()), interval)
        level = keyphasor_pulses(motion.angle, machine, width)
        count = machine.keyphasor.pulses_per_revolution
        pulses = "one pulse a revolution" if count == 1 else f"{count} pulses a revolution"
        data[machine.channel_in_file("keyphasor")] = _channel(level, "1", pulses)
    record = xr.Dataset(data, coords={"time": ("time", time, {"units": "s", "long_name": "time"})})
    record.attrs = {
        "source_file": "synthetic record",
        "sha256": "",
        "reader": "tdbsim",
        "title": title,
        "drop_time": "",
    }
    return record


def _interval(time: Array) -> float:
    steps = np.diff(time)
    if not len(steps):
        raise InputError(f"motion: {len(time)} samples are too few for a record; give at least two")
    interval = float(steps.mean())
    if not interval > 0 or np.abs(steps - interval).max() > 1e-3 * interval:
        raise InputError("motion: its times are not evenly spaced; give evenly spaced times")
    return interval


def _channel(values: Array, units: str, long_name: str) -> xr.DataArray:
    return xr.DataArray(values, dims=("time",), attrs={"units": units, "source_units": units, "long_name": long_name})


def _displacement(values: Array, full_scale: float, probe: str) -> xr.DataArray:
    array = _channel(quantised(values, full_scale), "m", f"shaft displacement, probe {probe}")
    if math.isfinite(full_scale):
        step = full_scale / -_CODES.min
        array.attrs["full_scale"] = [_CODES.min * step, _CODES.max * step]
        array.encoding = {"dtype": np.dtype(np.int16), "scale_factor": step, "add_offset": 0.0}
    return array
