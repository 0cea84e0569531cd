"""Order tracking: amplitude and phase lag of the multiples of the rotor speed (1X, 2X, ...) during the run-down.

The displacement is resampled to equal steps of shaft angle, in which an order has a constant frequency whatever the
speed does, and Fourier coefficients are computed at each order over windows of whole revolutions (computed order
tracking; K. R. Fyfe and E. D. S. Munck, Mech. Syst. Signal Process. 11, 1997, 187-205).  Blackman-Harris windows limit
leakage, since the swing in the clearance is a hundred times larger than the lines beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.analysis.missing_stretches import too_long
from tdbmon.analysis.spectrum import cosine_window, window_gain
from tdbmon.record.timebase import usual_interval

PER_TURN = 128  # angle steps per revolution: even below 1 Hz no line of the rotor aliases to an order of interest
_ORDERS = np.array([1.0, 2.0])  # multiples of the speed
_REVOLUTIONS = 32  # per window: lines 4/32 of an order apart are resolved
_HOPS = 8  # hops per window length (overlap of 7/8)
_HIGHEST = 0.4  # share of the sampling rate above which the averaging loss is no longer compensated
_FEWEST = 4  # minimum of revolutions per window, and of window lengths per record
_BESIDE = np.array([-3, -2, 2, 3])  # bins with little of a steady tone, in which noise and neighbouring lines show


@dataclass(frozen=True)
class Turns:
    """Signals resampled by averaging over equal steps of shaft angle.

    Attributes
    ----------
    values : ndarray, shape (..., n * PER_TURN)
        NaN where the angle or the signal is unknown, and across a gap in the time axis.
    edges : ndarray, shape (n * PER_TURN + 1,)
        Times of the limits of the steps, s.
    start : float
        Angle turned through at the first edge, rad.
    rate : float
        Sampling rate of the original signals, Hz.
    """

    values: np.ndarray
    edges: np.ndarray
    start: float
    rate: float

    def gain(self, order: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Return the gain of the resampling for a tone: trapezoidal mean of two samples, then mean over an angle step."""
        share = np.minimum(order * speed / self.rate, _HIGHEST)
        return np.asarray(np.sinc(order / PER_TURN) * np.sinc(share) * np.cos(np.pi * share))

    def speed(self, first: np.ndarray, steps: int) -> np.ndarray:
        """Return the mean speed over `steps` angle steps from `first` on, Hz."""
        return np.asarray(steps / PER_TURN / (self.edges[first + steps] - self.edges[first]))


def resample(signals: np.ndarray, time: np.ndarray, turned: np.ndarray) -> Turns:
    """Resample signals to equal steps of shaft angle.

    The mean over each step (from the integral by the trapezoidal rule) is the anti-aliasing filter; `Turns.gain` is its
    effect on a tone.

    Parameters
    ----------
    signals : ndarray, shape (..., samples)
    time : ndarray, shape (samples,)
        Uniform except for gaps, s.
    turned : ndarray, shape (samples,)
        Angle turned through, rad, non-decreasing; NaN where unknown.

    Returns
    -------
    Turns
        Whole revolutions; empty if less than one is known, or if there are fewer than two samples per revolution.
    """
    known = np.flatnonzero(np.isfinite(turned))
    step = usual_interval(time) if len(time) > 1 else 0.0
    empty = Turns(np.empty((*signals.shape[:-1], 0)), np.zeros(1), 0.0, 1 / step if step else 0.0)
    if known.size < 2:
        return empty
    at, angle = time[known], turned[known]
    turns = (angle[-1] - angle[0]) / (2 * np.pi)
    count = int(turns) * PER_TURN
    if count == 0 or turns > (at[-1] - at[0]) / (
        2 * step
    ):  # fewer than two samples per revolution, or a speed in a wrong unit
        return empty
    edges = np.interp(angle[0] + 2 * np.pi / PER_TURN * np.arange(count + 1), angle, at)
    width = np.maximum(np.diff(edges), 1e-12)
    values = np.empty((*signals.shape[:-1], count))
    lost = ~np.isfinite(signals)
    for index in np.ndindex(signals.shape[:-1]):
        signal = np.where(lost[index], 0.0, signals[index]) if lost[index].any() else signals[index]
        values[index] = np.diff(np.interp(edges, time, _integral(signal, step))) / width
        if lost[index].any():
            values[index][np.diff(np.interp(edges, time, _integral(lost[index].astype(float), step))) > 0] = np.nan
    if known.size <= known[-1] - known[0]:  # the angle has gaps
        unknown = np.interp(edges, time, _integral(np.isnan(turned).astype(float), step))
        values[..., np.diff(unknown) > 0] = np.nan
    holes = np.append(0, np.cumsum(too_long(np.diff(time))))
    if holes[-1]:
        values[..., np.diff(np.interp(edges, time, holes)) > 0] = np.nan
    return Turns(values, edges, float(angle[0]), 1 / step)


def _integral(signal: np.ndarray, step: float) -> np.ndarray:
    """Return the running integral by the trapezoidal rule."""
    out = np.empty(len(signal))
    out[0] = 0.0
    np.cumsum((signal[1:] + signal[:-1]) * (step / 2), out=out[1:])
    return out


def coefficients(turns: Turns, orders: np.ndarray, revolutions: int, hop: int) -> np.ndarray:
    """Return Fourier coefficients of resampled signals at given orders, over Blackman-Harris windows.

    Parameters
    ----------
    turns : Turns
    orders : ndarray, shape (m,)
    revolutions : int
        Length of a window.
    hop : int
        Angle steps from one window to the next.

    Returns
    -------
    ndarray of complex, shape (..., frames, m)
        ``c`` in ``signal = Re sum c exp(j order angle)``, with the angle's origin as in `Turns.start`; NaN where a window
        contains NaN.
    """
    length = revolutions * PER_TURN
    weight = cosine_window("blackman-harris", length)
    step = np.arange(length) + 0.5  # the mean over a step refers to its centre
    kernel = np.exp(-2j * np.pi * step[:, None] * orders / PER_TURN) * (2 * weight / weight.sum())[:, None]
    values = np.isfinite(turns.values).sum(axis=-1, keepdims=True)
    centred = turns.values - np.nansum(turns.values, axis=-1, keepdims=True) / np.maximum(values, 1)
    frames = np.lib.stride_tricks.sliding_window_view(centred, length, axis=-1)[..., ::hop, :]
    raw = frames @ kernel.real + 1j * (frames @ kernel.imag)
    first = np.arange(frames.shape[-2]) * hop
    raw /= turns.gain(orders, turns.speed(first, length)[:, None])
    return np.asarray(raw * np.exp(-1j * np.outer(turns.start + 2 * np.pi * first / PER_TURN, orders)))


def track(planes: xr.Dataset, angle: np.ndarray, sense: int = 1) -> xr.Dataset:
    """Track 1X and 2X through the record, over windows of 32 revolutions, or a quarter of the record's if that is less.

    Parameters
    ----------
    planes : Dataset
        ``displacement(end, axis, time)``, m.
    angle : ndarray, shape (time,)
        Shaft angle from +x towards +y, rad, continuous (it falls where the rotor turns clockwise); NaN where unknown.
    sense : int
        +1 where the rotor turns from +x towards +y, -1 otherwise.

    Returns
    -------
    Dataset
        Over ``order``, ``end``, ``time`` (centre of the window, s; coordinate ``speed``, Hz):
        ``forward``, ``backward`` (radii of the two circles, m), ``forward_lag``, ``backward_lag``,
        ``forward_sigma``, ``backward_sigma``; and with ``axis``: ``amplitude`` (0-pk, m), ``lag``, ``sigma``.
        Lags are in rad, positive against the rotation: the angle from the passage of the shaft's zero mark to that of the
        high spot; for the backward circle, the lag of its mirror image in the x axis.  ``sigma`` is the standard deviation
        of an amplitude; divided by the amplitude, that of its lag.  It is estimated from the bins beside the order, averaged
        over one window length to either side, so that a line crossing the order increases it; a line that stays on the
        order cannot be separated.  ``time`` is empty if the angle covers fewer than 16 revolutions.

    Raises
    ------
    InputError
        If `angle` does not fit the time axis or runs against `sense`.
    """
    time = planes.time.to_numpy()
    turned = turned_through(angle, time, sense)
    signals = planes.displacement.transpose("end", "axis", "time").to_numpy()
    turns = resample(signals, time, turned)
    revolutions = min(_REVOLUTIONS, turns.values.shape[-1] // PER_TURN // _FEWEST)
    bins = np.concatenate([[0], _BESIDE])
    if revolutions < _FEWEST:
        none = np.empty((*signals.shape[:2], 0, _ORDERS.size), dtype=complex)
        return _tracks(planes, none, np.empty((4, *none[:, 0].shape)), np.empty(0), np.empty(0), sense, 0)
    length, hop = revolutions * PER_TURN, max(1, revolutions // _HOPS) * PER_TURN
    beside = _ORDERS[:, None] + bins / revolutions
    c = coefficients(turns, beside.ravel(), revolutions, hop)
    c = c.reshape(*c.shape[:-1], *beside.shape)  # (end, axis, window, order, bin)
    first = np.arange(c.shape[2]) * hop
    centre = turns.start + 2 * np.pi / PER_TURN * (first + length / 2)
    local = c * np.exp(1j * centre[:, None, None] * beside)  # phases relative to the window centre, alike in all bins
    residual = local[..., 1:] - local[..., :1] * window_gain("blackman-harris", _BESIDE.astype(float))
    about = length // hop  # windows that begin within one window's length
    noise = np.stack([_noise(r, about) for r in _parts(residual, sense)])
    middle = turns.edges[first + length // 2]
    return _tracks(planes, c[..., 0], noise, middle, turns.speed(first, length), sense, revolutions)


def turned_through(angle: np.ndarray, time: np.ndarray, sense: int) -> np.ndarray:
    """Return the angle turned through in the direction of rotation, rad, which never decreases.

    Raises
    ------
    InputError
        If `angle` does not fit the time axis or runs against `sense`.
    """
    if angle.shape != time.shape:
        raise InputError(f"{angle.size} shaft angles for {time.size} samples; give one per sample")
    turned = sense * angle
    known = turned[np.isfinite(turned)]
    if known.size > 1 and (np.diff(known) < 0).any():
        raise InputError("the shaft angle runs against the direction of rotation; check 'rotation' in the machine file")
    return turned


def _parts(c: np.ndarray, sense: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the coefficients of x, y, the forward circle and the backward one's mirror image; `c` is (end, axis, ...)."""
    x, y = c[:, 0], c[:, 1]
    return x, y, (x + 1j * sense * y) / 2, (x - 1j * sense * y) / 2


def _noise(residual: np.ndarray, about: int) -> np.ndarray:
    """Return the standard deviation of a coefficient's real part, from residuals (end, window, order, bin)."""
    power = (np.abs(residual) ** 2).mean(axis=-1) / 2
    known = np.isfinite(power)
    total = np.cumsum(np.pad(np.where(known, power, 0.0), ((0, 0), (1, 0), (0, 0))), axis=1)
    count = np.cumsum(np.pad(known.astype(int), ((0, 0), (1, 0), (0, 0))), axis=1)
    index = np.arange(power.shape[1])
    high, low = np.minimum(index + about + 1, power.shape[1]), np.maximum(index - about, 0)
    mean = (total[:, high] - total[:, low]) / np.maximum(count[:, high] - count[:, low], 1)
    return np.where(known, np.sqrt(mean), np.nan)


def _tracks(
    planes: xr.Dataset,
    c: np.ndarray,
    noise: np.ndarray,
    time: np.ndarray,
    speed: np.ndarray,
    sense: int,
    revolutions: int,
) -> xr.Dataset:
    parts = _parts(c, sense)

    def by_order(values: np.ndarray) -> np.ndarray:
        return np.moveaxis(values, -1, 0)

    whirl, lag = {"units": "m", "kind": "0-pk"}, {"units": "rad", "positive": "against rotation"}
    variables: dict[str, tuple] = {}
    for i, name in ((2, "forward"), (3, "backward")):
        dims = ("order", "end", "time")
        variables[name] = (dims, by_order(np.abs(parts[i])), whirl)
        variables[f"{name}_lag"] = (dims, by_order(-np.angle(parts[i])), lag)
        variables[f"{name}_sigma"] = (dims, by_order(noise[i]), {"units": "m"})
    by_axis = ("order", "end", "axis", "time")
    both = np.stack([parts[0], parts[1]], axis=1)
    variables["amplitude"] = (by_axis, by_order(np.abs(both)), whirl)
    variables["lag"] = (by_axis, by_order(-np.angle(both)), lag)
    variables["sigma"] = (by_axis, by_order(np.stack([noise[0], noise[1]], axis=1)), {"units": "m"})
    return xr.Dataset(
        variables,
        coords={
            "order": _ORDERS,
            "end": planes.end,
            "axis": planes.axis,
            "time": ("time", time, {"units": "s"}),
            "speed": ("time", speed, {"units": "Hz"}),
        },
        attrs={"window": "blackman-harris", "window_revolutions": revolutions},
    )
