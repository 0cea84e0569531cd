"""Spectra of the displacement against time (waterfall) and against speed (cascade), and the full spectrum.

A full spectrum splits the orbit z = x + j y into forward whirl (in the direction of rotation) and backward whirl
(against it): for a frequency f > 0 the coefficients of z at +f and -f, exchanged if the rotor turns clockwise
(A. Muszynska, *Rotordynamics*, CRC Press 2005, ch. 2; P. Goldman and A. Muszynska, "Application of full spectrum to
rotating machinery diagnostics", Orbit 20 (1), 1999).
Windows by F. J. Harris, Proc. IEEE 66, 1978, 51-83.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.analysis.unbroken import pieces
from tdbmon.record.timebase import usual_interval

_SCALE = "0-pk"  # amplitude scale
_WINDOWS = {
    "hann": (0.5, 0.5),
    "blackman-harris": (0.35875, 0.48829, 0.14128, 0.01168),  # four terms, sidelobes below -92 dB
}
_LONGEST_S = 1.0
_SHARE = 8  # window lengths in a short record
_TOP_HZ = 1000.0  # the vibration of a dropped rotor lies below
_CHUNK = 16  # frames transformed at a time, so that they stay in the processor's cache


def cosine_window(name: str, length: int) -> np.ndarray:
    """Return a periodic cosine-sum window: "hann" or "blackman-harris"."""
    turn = 2 * np.pi * np.arange(length) / length
    return np.asarray(sum((-1) ** i * a * np.cos(i * turn) for i, a in enumerate(_WINDOWS[name])))


def window_gain(name: str, offset: np.ndarray) -> np.ndarray:
    """Return a window's response to a tone `offset` bins off a bin, relative to a tone on it (limit of long windows)."""
    terms = _WINDOWS[name]
    total = terms[0] * np.sinc(offset)
    for i, a in enumerate(terms[1:], start=1):
        total = total + a / 2 * (np.sinc(offset - i) + np.sinc(offset + i))
    return np.asarray(total / terms[0])


def window_starts(time: np.ndarray, length: int, step: int) -> np.ndarray:
    """Return the first samples of windows `step` samples apart on a time axis (n,), which may have gaps.

    Windows are uniformly spaced in time, also across gaps; -1 for a window that spans a gap.
    """
    whole = pieces(time)
    number = np.arange(len(time))  # sample numbers on an axis without gaps
    for piece in whole[1:]:
        number[piece] += round((time[piece.start] - time[0]) / usual_interval(time)) - piece.start
    wanted = np.arange(0, number[-1] + 2 - length, step)
    starts = np.searchsorted(number, wanted)
    lasts = np.minimum(starts + length, len(time)) - 1
    unbroken = (number[starts] == wanted) & (number[lasts] == wanted + length - 1)
    return np.where(unbroken, starts, -1)


def short_time_spectra(signal: np.ndarray, starts: np.ndarray, length: int, bins: int, window: str) -> np.ndarray:
    """Return the short-time Fourier coefficients of a signal, with the mean of each window removed.

    Parameters
    ----------
    signal : ndarray, shape (samples,)
    starts : ndarray of int, shape (frames,)
        First sample of each window; -1 for one that spans a gap (`window_starts`).
    length : int
        Samples per window.
    bins : int
        Number of coefficients returned, from 0 Hz on.
    window : str
        "hann" or "blackman-harris".

    Returns
    -------
    ndarray of complex, shape (frames, bins)
        Scaled so that a tone on a bin has its 0-pk amplitude as modulus; NaN for a window with NaN or a start of -1.
    """
    weight = cosine_window(window, length)
    frames = np.lib.stride_tricks.sliding_window_view(signal, length)
    out = np.full((len(starts), bins), np.nan, dtype=complex)
    there = np.flatnonzero(starts >= 0)
    for first in range(0, len(there), _CHUNK):
        at = there[first : first + _CHUNK]
        some = frames[starts[at]]
        out[at] = np.fft.rfft((some - some.mean(axis=1, keepdims=True)) * weight, axis=1)[:, :bins]
    out *= 2 / weight.sum()
    return out


def forward_backward(x: np.ndarray, y: np.ndarray, sense: int) -> tuple[np.ndarray, np.ndarray]:
    """Split one-sided coefficients of x and y into forward and backward whirl.

    Parameters
    ----------
    x, y : ndarray of complex
        0-pk coefficients of both axes at positive frequencies.
    sense : int
        +1 where the rotor turns from +x towards +y, -1 otherwise.

    Returns
    -------
    forward, backward : ndarray of complex
        Their moduli are the radii of the two circles whose sum is the orbit; the major semi-axis is the sum of both.
    """
    ccw, cw = (x + 1j * y) / 2, (np.conj(x) + 1j * np.conj(y)) / 2
    return (ccw, cw) if sense > 0 else (cw, ccw)


def waterfall(planes: xr.Dataset, window_s: float | None = None, step_s: float | None = None) -> xr.Dataset:
    """Return amplitude spectra against time (Hann windows), 0-pk, up to 1 kHz or half the sampling rate.

    For the first second after the release pass only that stretch (``planes.sel(time=slice(t, t + 1))``), since windows
    are an eighth of a short record.

    Parameters
    ----------
    planes : Dataset
        ``displacement(end, axis, time)``, m, uniformly sampled except for gaps; attribute ``sampling_hz``.
    window_s : float, optional
        Window length, s; by default 1 s, or an eighth of a record shorter than 8 s.
    step_s : float, optional
        Hop between windows, s; by default a quarter of a window.

    Returns
    -------
    Dataset
        ``amplitude(end, axis, time, frequency)`` in m, ``time`` the centre of each window, s.  Attributes: ``window``,
        ``window_s``, ``step_s``, ``overlap``, ``coherent_gain`` (mean of the window, already corrected for),
        ``noise_bandwidth_bins``, ``noise_bandwidth_hz``, ``scale``.  A window that contains NaN or spans a gap in
        the time axis gives NaN.

    Raises
    ------
    InputError
        If a window is longer than the record or shorter than 16 samples, or the step is not positive.
    """
    frame = _Frame.of(planes, window_s, step_s)
    amplitude = np.abs(frame.transform(planes))
    return frame.dataset(planes, {"amplitude": (("end", "axis", "time", "frequency"), amplitude)})


def full_spectrum(planes: xr.Dataset, sense: int, window_s: float | None = None) -> xr.Dataset:
    """Return the full spectrum: forward and backward amplitude spectra against time, relative to the rotation.

    Parameters are those of `waterfall`; `sense` is +1 where the rotor turns from +x towards +y, -1 otherwise.

    Returns
    -------
    Dataset
        ``forward`` and ``backward(end, time, frequency)`` in m: radii of the circles whose sum is the orbit.  Coordinates
        and attributes as from `waterfall`.

    Raises
    ------
    InputError
        As `waterfall`.
    """
    frame = _Frame.of(planes, window_s, None)
    data = frame.transform(planes)
    parts = forward_backward(data[:, 0], data[:, 1], sense)
    variables = {
        name: (("end", "time", "frequency"), np.abs(part))
        for name, part in zip(("forward", "backward"), parts, strict=True)
    }
    return frame.dataset(planes, variables)


def cascade(
    spectra: xr.Dataset, speed_time: np.ndarray, speed_hz: np.ndarray, step_hz: float | None = None
) -> xr.Dataset:
    """Return spectra against speed: those of a waterfall, averaged in power over equal steps of speed.

    Parameters
    ----------
    spectra : Dataset
        Result of `waterfall` or `full_spectrum`.
    speed_time, speed_hz : ndarray, shape (n,)
        Speed, Hz, at its own sample times, s.
    step_hz : float, optional
        Width of a step, Hz; by default a hundredth of the highest speed.

    Returns
    -------
    Dataset
        The variables with ``speed`` (centre of a step, Hz, increasing) in place of ``time``, and ``spectra(speed)``, the
        number of windows in a step.  Steps without windows are omitted; a spectrum is NaN if all its windows lack samples.

    Raises
    ------
    InputError
        If no speed is known at the times of the spectra, or `step_hz` is not positive.
    """
    known = np.isfinite(speed_hz)
    centre = spectra.time.to_numpy()
    inside = np.zeros(len(centre), dtype=bool)
    if known.sum() > 1:
        at, hz = speed_time[known], speed_hz[known]
        inside = (centre >= at[0]) & (centre <= at[-1])
    if not inside.any():
        raise InputError("no speed is known at the times of the spectra; a cascade needs it")
    speed = np.maximum(mean_over(at, hz, centre[inside], spectra.attrs["window_s"]), 0.0)
    width = step_hz if step_hz is not None else max(speed.max() / 100, 1e-6)
    if not width > 0:
        raise InputError(f"a speed step of {width:g} Hz is not positive; a cascade needs a positive one")
    steps, member, count = np.unique(np.floor(speed / width), return_inverse=True, return_counts=True)
    variables = {}
    for name, values in spectra.data_vars.items():
        power = np.moveaxis(values.transpose(..., "time", "frequency").to_numpy(), -2, 0)[inside] ** 2
        there = np.isfinite(power[..., :1])  # a window with missing samples is NaN at all frequencies
        total, seen = (np.zeros((len(steps), *each.shape[1:])) for each in (power, there))
        np.add.at(total, member, np.where(there, power, 0.0))
        np.add.at(seen, member, there)
        mean = np.sqrt(np.divide(total, seen, out=np.full_like(total, np.nan), where=seen > 0))
        dims = tuple("speed" if d == "time" else d for d in values.transpose(..., "time", "frequency").dims)
        variables[name] = (dims, np.moveaxis(mean, 0, -2), values.attrs)
    variables["spectra"] = (("speed",), count, {})
    coords = {name: c for name, c in spectra.coords.items() if "time" not in c.dims}
    coords["speed"] = xr.DataArray((steps + 0.5) * width, dims="speed", attrs={"units": "Hz"})
    return xr.Dataset(variables, coords=coords, attrs={**spectra.attrs, "speed_step_hz": float(width)})


def mean_over(time: np.ndarray, values: np.ndarray, centre: np.ndarray, width: float) -> np.ndarray:
    """Return the mean of a sampled quantity over windows of `width` about `centre`, s (truncated to the known range)."""
    integral = np.concatenate([[0.0], np.cumsum(np.diff(time) * (values[1:] + values[:-1]) / 2)])
    low = np.clip(centre - width / 2, time[0], time[-1])
    high = np.clip(centre + width / 2, time[0], time[-1])
    gain = np.interp(high, time, integral) - np.interp(low, time, integral)
    length = high - low
    return np.where(length > 0, gain / np.where(length > 0, length, 1.0), np.interp(centre, time, values))


@dataclass(frozen=True)
class _Frame:
    """Window layout of a waterfall: rate, Hz, length and step in samples, bins kept, and first time, s."""

    rate: float
    length: int
    step: int
    bins: int
    first: float

    @classmethod
    def of(cls, planes: xr.Dataset, window_s: float | None, step_s: float | None) -> _Frame:
        rate, samples = float(planes.attrs["sampling_hz"]), planes.sizes["time"]
        duration = samples / rate
        wanted = min(_LONGEST_S, duration / _SHARE) if window_s is None else window_s
        length = round(wanted * rate)
        if not 16 <= length <= samples:
            raise InputError(
                f"a window of {wanted:g} s holds {length} of the record's {samples} samples at {rate:g} Hz;"
                f" give 16 samples ({16 / rate:g} s) or more, at most the whole record ({duration:g} s)"
            )
        step = round((length / 4) if step_s is None else step_s * rate)
        if step < 1:
            raise InputError(f"a step of {step_s:g} s is less than one sample; give at least {1 / rate:g} s")
        bins = min(length // 2, int(_TOP_HZ * length / rate)) + 1
        return cls(rate, length, step, bins, float(planes.time[0]))

    def transform(self, planes: xr.Dataset) -> np.ndarray:
        """Return the Fourier coefficients, shape (end, axis, frames, bins)."""
        signals = planes.displacement.transpose("end", "axis", "time").to_numpy()
        starts = window_starts(planes.time.to_numpy(), self.length, self.step)
        return np.array(
            [[short_time_spectra(s, starts, self.length, self.bins, "hann") for s in end] for end in signals]
        )

    def dataset(self, planes: xr.Dataset, variables: dict[str, tuple]) -> xr.Dataset:
        """Return amplitude variables with coordinates and window attributes as a dataset."""
        frames = next(iter(variables.values()))[1].shape[-2]
        weight = cosine_window("hann", self.length)
        bandwidth = float(self.length * np.sum(weight**2) / weight.sum() ** 2)
        units = {"units": "m", "kind": _SCALE}
        return xr.Dataset(
            {name: (dims, values, units) for name, (dims, values) in variables.items()},
            coords={
                "end": planes.end,
                **({"axis": planes.axis} if any("axis" in dims for dims, _ in variables.values()) else {}),
                "time": (
                    "time",
                    self.first + (np.arange(frames) * self.step + self.length / 2) / self.rate,
                    {"units": "s"},
                ),
                "frequency": ("frequency", np.arange(self.bins) * self.rate / self.length, {"units": "Hz"}),
            },
            attrs={
                "window": "hann",
                "window_s": self.length / self.rate,
                "step_s": self.step / self.rate,
                "overlap": max(0.0, 1 - self.step / self.length),
                "coherent_gain": float(weight.mean()),
                "noise_bandwidth_bins": bandwidth,
                "noise_bandwidth_hz": bandwidth * self.rate / self.length,
                "scale": _SCALE,
            },
        )
