"""The spectral lines of a run-down: orders of rotation, constant frequencies, mains.

Two sets of spectra are searched by one rule: spectra against time, in which a constant frequency stays in its cell, and
spectra over shaft angle, in which an order does.  A line is detected in 4 of 8 windows (`cfar`: at most one record of
noise in a hundred raises an alarm) and obeys the law of its set (`ridge`): the exponent p in "frequency ~ speed^p" is 0
or 1, and the other value is excluded.  A peak that obeys neither, such as a sideband "1X - swing" caused by the arc on which
the rotor swings, is not a line; one for which the speed changes too little to decide is omitted, as are most in records of
less than a second or two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.analysis import cfar
from tdbmon.analysis.line_names import Band, name_constants, order_name
from tdbmon.analysis.order import PER_TURN, resample
from tdbmon.analysis.ridge import WINDOW, Ridge, Spectra, find_ridges
from tdbmon.analysis.spectrum import forward_backward, mean_over, short_time_spectra, window_gain, window_starts
from tdbmon.estimate import Z95, Estimate

Kind = Literal["order", "constant", "mains"]
Direction = Literal["forward", "backward", "both"]

_LONGEST_S = 1.0
_REVOLUTIONS = 32
_SHARE = (cfar.WINDOWS + 1) / 2  # window lengths that a short record must hold, for the windows of one decision
_TOP_HZ = 1000.0
_TOP_ORDER = 12.0
_SLOWEST = 0.02  # of the highest speed: below, the shaft angle is not tracked
_SAME = 1.5  # cells within which ridges of several channels belong to one line
_ROUND = 3.0  # ratio of forward and backward circles beyond which a direction is named: an orbit half as wide as long
_LOBE = 6.0  # cells: main lobe of the window, and the drift of a line within it
_HIDING = 0.3  # of the order's amplitude: a constant line so strong masks it
_ROUNDING = 1e-12  # of a displacement
_STEADY = 0.3  # amplitude in the last third relative to the first: more is a line that does not decay
_BESIDE = 0.7  # cells: greatest mean distance of a sideband from its expected place
_FREQUENCY = ("mean over its windows", "mean order over its windows, times the speed at its greatest amplitude")
_AMPLITUDE = (
    "greatest semi-major axis over its windows; for an order without those in which a constant line of more than"
    f" {_HIDING:g} of its amplitude crosses it"
)
_FRACTIONS = ((1, 12.0), (2, 4.5), (3, 2.0))  # denominators of orders that rubbing excites, and the highest such order
_SIMPLE = 0.005  # relative: an order so near to a simple fraction is taken as that (a filtered speed signal lags)
_WIDEST = 0.03  # orders: upper limit of that tolerance


@dataclass(frozen=True)
class Line:
    """A spectral line.

    Attributes
    ----------
    kind : {"order", "constant", "mains"}
    order : float or None
        Multiple of the speed: a simple fraction if it is close to one, otherwise as measured.
    frequency : Estimate
        Mean over the windows, Hz; for an order, that at the time of its greatest amplitude.
    direction : {"forward", "backward", "both"}
        Whirl relative to the rotation; "both" if the orbit is less than half as wide as long.
    end : str
        Where it is detected; "both" for both ends.
    amplitude : Estimate
        Semi-major axis of the line's orbit, 0-pk, m, at the end where it is greater: maximum over the windows, for an order
        without those in which a constant line crosses and masks it; median for mains.
    first_s, last_s : float
        Middle of the first and of the last window in which it is detected, s.
    name : str
        "1X", "1/2X", "mains", "swing 1", "2 x swing 1", "swing 2 - swing 1", a name from `expected` ("bounce"), or its frequency.
    combined : bool
        Whether it is a multiple of another line, or a sum or difference of others.
    """

    kind: Kind
    order: float | None
    frequency: Estimate
    direction: Direction
    end: str
    amplitude: Estimate
    first_s: float
    last_s: float
    name: str
    combined: bool = False


@dataclass(frozen=True)
class Trace:
    """A line and its history over the windows, merged from the ridges of several channels.

    Attributes
    ----------
    line : Line
    window : ndarray of int, shape (n,)
        Indices of the windows in which it is detected, increasing.
    time, speed, place, height : ndarray, shape (n,)
        Time, s; speed, Hz; frequency, Hz, or order; amplitude at the end where it is greatest, m.
    horizontal : float
        Share of x in its power.
    steady : bool
        Whether its amplitude does not decay.
    """

    line: Line
    window: np.ndarray
    time: np.ndarray
    speed: np.ndarray
    place: np.ndarray
    height: np.ndarray
    horizontal: float
    steady: bool

    def place_at(self, window: np.ndarray) -> np.ndarray:
        """Return frequency or order in given windows, in which it must be detected."""
        return np.asarray(self.place[np.searchsorted(self.window, window)])


def find_lines(
    planes: xr.Dataset,
    speed_time: np.ndarray,
    speed_hz: np.ndarray,
    sense: int,
    mains_hz: float,
    expected: Sequence[Band] = (),
) -> tuple[Line, ...]:
    """Find the spectral lines of a record, and distinguish orders from constant frequencies.

    Parameters
    ----------
    planes : Dataset
        ``displacement(end, axis, time)``, m, uniformly sampled except for gaps; attribute ``sampling_hz``.
    speed_time, speed_hz : ndarray, shape (n,)
        Times, s, and speed, Hz, on a time base of its own.
    sense : int
        +1 if the rotor turns from +x towards +y, -1 otherwise.
    mains_hz : float
        Frequency of the electric supply, Hz.
    expected : sequence of Band
        Bands in which the strongest line gets a name; they do not affect detection.

    Returns
    -------
    tuple of Line
        Orders first, then by frequency.

    Raises
    ------
    InputError
        If speed and its times differ in length.
    """
    if len(speed_time) != len(speed_hz):
        raise InputError(f"{len(speed_hz)} values of speed for {len(speed_time)} times; give one value per time")
    known = np.isfinite(speed_hz) & np.isfinite(speed_time)
    if known.sum() < 2:
        return ()
    speed_time, speed_hz = speed_time[known], np.maximum(speed_hz[known], 0.0)
    against_time = spectra_against_time(planes, speed_time, speed_hz)
    ends = [str(end) for end in planes.end.values]
    constants = _traces(against_time, ends, sense, ())
    over_angle = _over_angle(planes, speed_time, speed_hz)
    orders = _traces(over_angle, ends, sense, constants)
    orders = [t for t in orders if not _is_sideband(t, orders, constants, over_angle.resolution)]
    constants = name_constants(constants, mains_hz, against_time.resolution, expected)
    return tuple(t.line for t in orders + constants)


def spectra_against_time(planes: xr.Dataset, speed_time: np.ndarray, speed_hz: np.ndarray) -> Spectra:
    """Return the spectra in which a constant frequency stays in its cell, given the speed (Hz) at times (s)."""
    rate = float(planes.attrs["sampling_hz"])
    length = round(min(_LONGEST_S, planes.sizes["time"] / rate / _SHARE) * rate)
    cells = min(length // 2, int(_TOP_HZ * length / rate) + cfar.LAST) + 1
    if cells <= cfar.FIRST + cfar.LAST:
        return _none(planes, 0)
    starts = window_starts(planes.time.to_numpy(), length, length // 2)
    c = _spectra_of(planes.displacement.transpose("end", "axis", "time").to_numpy(), starts, length, cells)
    time = float(planes.time[0]) + (np.arange(c.shape[2]) * (length // 2) + length / 2) / rate
    speed = mean_over(speed_time, speed_hz, time, length / rate)
    speed[(time < speed_time[0]) | (time > speed_time[-1])] = np.nan
    return Spectra(0, c, rate / length, time, speed, np.ones(c.shape[2:]))


def _over_angle(planes: xr.Dataset, speed_time: np.ndarray, speed_hz: np.ndarray) -> Spectra:
    time = planes.time.to_numpy()
    speed = np.interp(time, speed_time, speed_hz, left=np.nan, right=np.nan)
    turning = np.flatnonzero(speed > _SLOWEST * np.max(speed_hz))
    turned = np.full(time.shape, np.nan)
    if turning.size > 1:
        some = slice(turning[0], turning[-1] + 1)
        step = np.diff(time[some]) * np.pi * (speed[some][1:] + speed[some][:-1])
        turned[some] = np.concatenate([[0.0], np.cumsum(step)])
    turns = resample(planes.displacement.transpose("end", "axis", "time").to_numpy(), time, turned)
    revolutions = min(_REVOLUTIONS, int(turns.values.shape[-1] / PER_TURN / _SHARE))
    length = revolutions * PER_TURN
    cells = min(length // 2, int(_TOP_ORDER * revolutions) + cfar.LAST) + 1
    if cells <= cfar.FIRST + cfar.LAST:
        return _none(planes, 1)
    first = np.arange(0, turns.values.shape[-1] - length + 1, length // 2)
    c = _spectra_of(turns.values, first, length, cells)
    mean = turns.speed(first, length)
    gain = turns.gain(np.arange(cells) / revolutions, mean[:, None])
    return Spectra(1, c, 1 / revolutions, turns.edges[first + length // 2], mean, gain)


def _none(planes: xr.Dataset, law: int) -> Spectra:
    """Return the empty spectra of a record that is too short."""
    return Spectra(law, np.empty((planes.sizes["end"], 2, 0, 0)), 1.0, np.empty(0), np.empty(0), np.empty((0, 0)))


def _spectra_of(signals: np.ndarray, starts: np.ndarray, length: int, cells: int) -> np.ndarray:
    high, low = np.fmax.reduce(signals, axis=-1), np.fmin.reduce(signals, axis=-1)
    still = high - low <= _ROUNDING * np.maximum(np.abs(high), np.abs(low))  # rounding errors would show as lines
    signals = np.where(still[..., None], 0.0, signals)
    return np.array([[short_time_spectra(s, starts, length, cells, WINDOW) for s in end] for end in signals])


def _traces(spectra: Spectra, ends: Sequence[str], sense: int, constants: Sequence[Trace]) -> list[Trace]:
    """Find the lines in a set of spectra; `constants` mask an order where they cross it."""
    ridges, floor = find_ridges(spectra)
    clear = [[[_clear_of(r, spectra, constants) for r in axis] for axis in end] for end in ridges]
    flat = [(r, e, a) for e, end in enumerate(clear) for a, axis in enumerate(end) for r in axis if r is not None]
    groups: list[list[tuple[Ridge, int, int]]] = []
    for item in sorted(flat, key=lambda f: f[0].middle):
        if groups and _one_line(groups[-1][-1][0], item[0], spectra.resolution):
            groups[-1].append(item)
        else:
            groups.append([item])
    return [_trace(spectra, floor, group, ends, sense) for group in groups]


def _clear_of(ridge: Ridge, spectra: Spectra, constants: Sequence[Trace]) -> Ridge | None:
    """Return an order's ridge without the windows in which a strong constant line is within its main lobe; None if few remain."""
    if not constants:
        return ridge
    time, speed = spectra.time[ridge.window], spectra.speed[ridge.window]
    hidden = np.zeros(len(time), dtype=bool)
    for trace in constants:
        hz = np.interp(time, trace.time, trace.place)
        near = np.abs(hz / speed - ridge.place) < _LOBE * spectra.resolution
        there = (time >= trace.time[0] - _LONGEST_S) & (time <= trace.time[-1] + _LONGEST_S)
        hidden |= near & there & (np.interp(time, trace.time, trace.height) ** 2 > _HIDING**2 * ridge.power)
    return ridge.at(~hidden) if (~hidden).sum() >= cfar.HITS else None


def _one_line(a: Ridge, b: Ridge, resolution: float) -> bool:
    """Return whether two ridges have the same place, within the intervals too, since a brief mode is uncertain."""
    (_, half_a), (_, half_b) = a.mean(), b.mean()
    return abs(a.middle - b.middle) < _SAME * resolution + min(half_a + half_b, _SAME * resolution)


def _trace(
    spectra: Spectra, floor: np.ndarray, group: list[tuple[Ridge, int, int]], ends: Sequence[str], sense: int
) -> Trace:
    place, half = min((r.mean() for r, _, _ in group), key=lambda m: m[1])
    count = len(spectra.time)
    power, course = np.zeros(count), np.zeros(count)
    shown = np.zeros((*spectra.coefficients.shape[:2], count), dtype=bool)
    for ridge, e, a in group:
        better = ridge.window[ridge.power > power[ridge.window]]
        course[better] = ridge.place[np.isin(ridge.window, better)]
        power[ridge.window] = np.maximum(power[ridge.window], ridge.power)
        shown[e, a, ridge.window] = True
    window = np.flatnonzero(power)
    places, seen = course[window], shown[:, :, window]
    cell = np.round(places / spectra.resolution).astype(int)
    c = np.nan_to_num(spectra.coefficients[:, :, window, cell])
    c /= window_gain(WINDOW, places / spectra.resolution - cell) * spectra.gain[window, cell]
    c = np.where(seen, c, 0.0)  # in a channel without a detection the amplitude there is not the line's
    noise = np.nan_to_num(floor[:, :, window, cell])
    circles = np.stack([np.abs(part) for part in forward_backward(c[:, 0], c[:, 1], sense)])
    major = circles.sum(axis=0)
    sigma = np.sqrt(noise.sum(axis=1)) / 2
    end = int(np.argmax(np.median(major, axis=1)))
    height, third = major[end], max(1, len(window) // 3)
    steady = bool(np.median(height[-third:]) > _STEADY * np.median(height[:third]))
    peak = int(np.argmax(height - Z95 * sigma[end]))
    speed = float(spectra.speed[window[peak]]) if spectra.law else 1.0
    whole = seen[end].all(axis=0)  # a direction needs the detection in both axes
    used = whole if whole.any() else np.ones_like(whole)
    order = _simple(place, half) if spectra.law else None
    line = Line(
        kind="order" if spectra.law else "constant",
        order=order,
        frequency=Estimate(
            place * speed, (place - half) * speed, (place + half) * speed, "Hz", _FREQUENCY[spectra.law]
        ),
        direction=_direction(*np.sqrt(np.sum((circles[:, end, used] / sigma[end, used]) ** 2, axis=1))),
        end=_end_name(group, ends),
        amplitude=Estimate.from_sigma(
            float(height[peak]), float(sigma[end, peak]), "um", _AMPLITUDE, "0-pk", least=0.0
        ),
        first_s=float(spectra.time[min(r.first for r, _, _ in group)]),
        last_s=float(spectra.time[max(r.last for r, _, _ in group)]),
        name="" if order is None else order_name(order),
    )
    horizontal = np.sum(np.abs(c[:, 0]) ** 2) / np.sum(np.abs(c) ** 2)
    return Trace(line, window, spectra.time[window], spectra.speed[window], places, height, float(horizontal), steady)


def _end_name(group: list[tuple[Ridge, int, int]], ends: Sequence[str]) -> str:
    shown = {e for _, e, _ in group}
    return "both" if len(shown) > 1 else ends[shown.pop()]


def _is_sideband(trace: Trace, orders: Sequence[Trace], constants: Sequence[Trace], width: float) -> bool:
    """Return whether a non-integer order is rather a sideband: a more persistent order plus or minus a constant line."""
    if (trace.line.order or 0.0).is_integer():
        return False
    own = np.std(trace.place)
    for carrier in orders:
        if carrier is trace or len(carrier.window) <= len(trace.window) or carrier.line.order is None:
            continue
        for constant in constants:
            shift = np.interp(trace.time, constant.time, constant.place) / trace.speed
            for sign in (1, -1):
                gap = trace.place - carrier.line.order - sign * shift
                if abs(np.mean(gap)) < _BESIDE * width and np.std(gap) < own + _BESIDE * width / 2:
                    return True
    return False


def _direction(forward: float, backward: float) -> Direction:
    if forward > _ROUND * backward:
        return "forward"
    return "backward" if backward > _ROUND * forward else "both"


def _simple(order: float, half: float) -> float:
    """Return the integer, low half or low third that the order agrees with, or else the order itself."""
    for parts, highest in _FRACTIONS:
        near = round(order * parts) / parts
        if 0 < near <= highest and abs(order - near) < min(max(half, _SIMPLE * order), _WIDEST):
            return near
    return order
