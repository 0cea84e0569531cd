"""Rotation of the shaft about a release: a constant acceleration fitted to keyphasor and speed signal before it.

Where that does not fit the whole levitated stretch, as when the drive trips shortly before the release, only the last part that
it fits is used.  A speed signal is taken at its stated scale unless the keyphasor contradicts it; then the pulses set the scale.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.analysis.observed_speed import between, block_means
from tdbmon.identify.even_stretch import last_even_means, last_even_turns
from tdbmon.record.held_speed import HELD
from tdbmon.record.keyphasor import Pulses, pulses
from tdbmon.record.samples import times_of

Array = NDArray[np.float64]

_FEWEST_PULSES = 3  # before the release, for angle, speed and acceleration
_FEWEST_SPEEDS = 10  # samples of the speed before the release; more are needed for a slope and its scatter
_FEWEST_HELD = 3  # the same for values that are each held over many samples
_MEANS = 320  # block means of the speed, by which the last stretch with a constant acceleration is found
_SCATTER_FREEDOM = 10  # degrees of freedom, needed to compare the scatter of pulses with their rounding
_ALIKE = 0.25  # of the variance of rounding; less means turns of whole samples, with one common rounding error
_PLAINLY = 4.0  # standard deviations, from which on the scale of a speed signal is wrong
_BLOCKS = 10  # of the speed, whose means show its error at low frequency
_SLOWLY = 1.8  # times the scatter of block means expected of white noise, which exceeds this once in a thousand
_LEAST_SPREAD = 1e-4  # of the speed: no signal is assumed to be better


@dataclass(frozen=True, eq=False)
class Turning:
    """Shaft angle ``angle + omega t + acceleration t^2 / 2`` before the release, t counted from it (SI).

    Attributes
    ----------
    angle, angle_sigma : float
        At the release and its standard deviation, rad; infinite without a keyphasor.
    omega : float
        Angular speed there, rad/s, negative clockwise.
    acceleration, acceleration_sigma : float
        rad/s^2, and its standard deviation.
    pulse_times, pulse_angles : (m,) arrays
        Keyphasor pulses after the release, s and rad; empty where they do not give the angle.
    pulse_sigma : float
        Standard deviation of a pulse's angle, rad.
    begin : float
        s of the record, since when this holds; minus infinity where from the first sample on.
    signal_over_pulses : float
        Speed signal over the keyphasor's speed where the two contradict each other; 1 elsewhere.
    """

    angle: float
    angle_sigma: float
    omega: float
    acceleration: float
    acceleration_sigma: float
    pulse_times: Array
    pulse_angles: Array
    pulse_sigma: float
    begin: float = -math.inf
    signal_over_pulses: float = 1.0

    def since(self, t: Array) -> Array:
        """Angle turned (n,), rad, at times t (n,), s, from the release; after it at constant speed."""
        return self.omega * t + 0.5 * self.acceleration * np.minimum(t, 0.0) ** 2


def fit_turning(laid: xr.Dataset, machine: Machine, release: float, name: str) -> Turning:
    """Fit the shaft's angle before the release to keyphasor and speed signal.

    Parameters
    ----------
    laid : Dataset
        A record with its channels assigned to the machine.
    machine : Machine
    release : float
        s.
    name : str
        Name of the record in error messages.

    Raises
    ------
    InputError
        If neither gives the speed before the release.
    """
    marks = pulses(laid, machine) if "keyphasor" in laid and machine.keyphasor is not None else None
    times, turns, sigma, factor = np.empty(0), np.empty(0), np.inf, 1.0
    if marks is not None and len(marks.times) > 3:
        times, turns = marks.times - release, marks.turns.astype(float)
    before = times < 0
    keyed = before.sum() >= _FEWEST_PULSES
    marked = keyed and machine.keyphasor is not None and machine.keyphasor.pulses_per_revolution == 1
    parts: list[tuple[Array, Array]] = []
    begin = _even_speed_since(laid, release)
    if marks is not None and keyed:
        since, factor = _even_since(marks, release)
        begin = max(since, min(begin, float(marks.times[before][-_FEWEST_PULSES])))
        before &= marks.times >= begin
        t = times[before]
        frequency = (turns[before][-1] - turns[before][0]) / (t[-1] - t[0])
        sigma = float(marks.sigma * frequency)
        parts.append((np.column_stack([np.ones_like(t), t, t**2]) / (factor * sigma), turns[before] / (factor * sigma)))
    parts += _speed_rows(laid, release, begin)
    if not parts:
        raise InputError(
            f"{name}: neither keyphasor nor speed signal gives the speed before the release, which the model needs: record a"
            " keyphasor, or the speed at the probes' rate, or at least 4 speed values in the levitated stretch"
        )
    if not keyed:  # the angle is arbitrary then
        parts.append((np.array([[1.0, 0.0, 0.0]]), np.zeros(1)))
    design, target = (np.concatenate(each) for each in zip(*parts, strict=True))
    over = 1.0
    if marks is not None and keyed:
        tick = math.sqrt(12) * marks.sigma / float(np.ptp(times[before]))
        over, design = _scale_from_pulses(design, target, before.sum(), tick)
    solution, *_ = np.linalg.lstsq(design, target, rcond=None)
    covariance = np.linalg.pinv(design.T @ design)
    angle_sigma = 2 * np.pi * float(np.sqrt(covariance[0, 0])) if marked else np.inf
    if marked and _rounded_alike(factor * (target - design @ solution)[: before.sum()]):
        angle_sigma = math.hypot(angle_sigma, 2 * np.pi * sigma)
    mark = machine.keyphasor.angle if machine.keyphasor else 0.0
    full = machine.sense * 2 * np.pi
    later = (times >= 0) & marked
    return Turning(
        angle=mark + full * float(solution[0]),
        angle_sigma=angle_sigma,
        omega=full * float(solution[1]),
        acceleration=full * 2 * float(solution[2]),
        acceleration_sigma=4 * math.pi * float(np.sqrt(covariance[2, 2])),
        pulse_times=times[later] + release,
        pulse_angles=mark + full * turns[later],
        pulse_sigma=2 * np.pi * sigma,
        begin=begin,
        signal_over_pulses=over,
    )


def _rounded_alike(left: Array) -> bool:
    """Return whether the residuals (n,) show that all pulses have the same rounding error, which averaging does not reduce."""
    freedom = len(left) - _FEWEST_PULSES
    return freedom >= _SCATTER_FREEDOM and float(left @ left) < _ALIKE * freedom


def _scale_from_pulses(design: Array, target: Array, pulses: int, tick: float) -> tuple[float, Array]:
    """Return the ratio of a speed signal to the speed by pulses, and the rows of a fit with the signal's scale free.

    Return 1 and the unchanged rows where the two agree within their noise or the drift of the pulses' rounding.

    Parameters
    ----------
    design, target : (n, 3) and (n,) arrays
        Rows of the pulses, then of the signal.
    pulses : int
        Number of pulses.
    tick : float
        Resolution of a pulse's time over the time from the first pulse to the last.
    """
    if len(target) == pulses:
        return 1.0, design
    freed = np.column_stack([design, np.where(np.arange(len(target)) < pulses, 0.0, target)])
    solution, *_ = np.linalg.lstsq(freed, target, rcond=None)
    left = (target - freed @ solution)[:pulses]
    # pulses may scatter more than by rounding
    loose = max(1.0, float(left @ left) / max(pulses - _FEWEST_PULSES, 1))
    surplus, sigma = float(solution[3]), math.sqrt(loose * float(np.linalg.pinv(freed.T @ freed)[3, 3]))
    if abs(surplus) <= max(_PLAINLY * sigma, tick):
        return 1.0, design
    return 1 / (1 - surplus), freed


def _even_since(marks: Pulses, release: float) -> tuple[float, float]:
    """Return since when the pulses fit a constant acceleration, s, and the factor on their noise."""
    turns = between(marks).between(-math.inf, release)
    even, factor = last_even_turns(turns, marks.sigma)
    return -math.inf if len(even) == len(turns) else float(even.begin[0]), factor


def _even_speed_since(laid: xr.Dataset, release: float) -> float:
    """Return since when the speed signal fits a constant acceleration, s."""
    if "speed" not in laid:
        return -math.inf
    channel = laid["speed"]
    time = times_of(channel)
    means = block_means(time, channel.values, -math.inf, release, _MEANS)
    even = last_even_means(means)
    if len(even) == len(means):
        return -math.inf
    fewest = time[(time < release) & np.isfinite(channel.values)][-_FEWEST_SPEEDS - 1 :]
    return min(float(even.begin[0]), float(fewest[0]))


def _speed_rows(laid: xr.Dataset, release: float, begin: float) -> list[tuple[Array, Array]]:
    """Return design rows (n, 3) for turns, turns/s and half the acceleration, and target (n,), of the speed before a release."""
    if "speed" not in laid:
        return []
    channel = laid["speed"]
    at = times_of(channel) - release
    keep = (at < 0) & (at >= begin - release) & np.isfinite(channel.values)
    at, hz = at[keep], channel.values[keep]
    held = float(channel.attrs.get(HELD, 0.0))
    if len(hz) <= (_FEWEST_HELD if held else _FEWEST_SPEEDS):
        return []
    at = at - held / 2  # a held value was read up to `held` s earlier, half of that on average
    slope = np.polyfit(at, hz, 1)
    spread = max(_spread(hz - np.polyval(slope, at)), _LEAST_SPREAD * float(np.mean(hz)))
    # the error by their age is common to all values, so averaging does not reduce it
    spread = math.hypot(spread, math.sqrt(len(hz)) * held / 2 * abs(float(slope[0])))
    return [(np.column_stack([np.zeros_like(at), np.ones_like(at), 2 * at]) / spread, hz / spread)]


def _spread(left: Array) -> float:
    """Return the standard deviation of residuals (n,) about a line; for correlated ones that of equivalent white noise.

    The errors of a smoothed signal are correlated, so its block means scatter more than independent samples would.
    """
    alone, size = float(np.std(left, ddof=2)), len(left) // _BLOCKS
    if size < 2:
        return alone
    means = left[: size * _BLOCKS].reshape(_BLOCKS, size).mean(axis=1)
    slow = math.sqrt(size) * float(np.std(means, ddof=2))
    return slow if slow > _SLOWLY * alone else alone
