"""How the shaft turns about a release, by keyphasor and speed signal: a uniform acceleration fitted to both before it.

Where one does not fit all of the levitated stretch, as where the drive trips shortly before the release, to the last part that
one fits.  A speed signal counts with the scale that is stated for it, unless the keyphasor contradicts that: then the pulses set
the scale.
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

_FEWEST_PULSES = 3  # before the release, which tell angle, speed and acceleration
_FEWEST_SPEEDS = 10  # samples of the speed before it, of which more are needed to tell a slope and its scatter
_FEWEST_HELD = 3  # the same of values that each stand for many samples
_MEANS = 320  # of the speed, from which it is told since when one line fits
_SCATTER_TOLD = 10  # pulses more than are needed, from which on it is told whether they scatter as their rounding does
_ALIKE = 0.25  # of its power: turns of whole samples, whose pulses are all rounded by as much
_PLAINLY = 4.0  # standard deviations, by which its scale is wrong
_BLOCKS = 10  # of the speed, whose means tell how it errs at low frequency
_SLOWLY = 1.8  # times what their samples let expect, as means of white noise scatter once in a thousand
_LEAST_SPREAD = 1e-4  # of the speed: no signal is taken for better


@dataclass(frozen=True, eq=False)
class Turning:
    """Shaft angle ``angle + omega t + acceleration t^2 / 2`` before the release, t counted from it (SI).

    Attributes
    ----------
    angle, angle_sigma : float
        At the release and its standard deviation, rad; an infinite one where no keyphasor tells.
    omega : float
        Angular speed there, rad/s, negative clockwise.
    acceleration, acceleration_sigma : float
        rad/s^2, and its standard deviation.
    pulse_times, pulse_angles : (m,) arrays
        Keyphasor after the release, s and rad; empty where it does not tell the angle.
    pulse_sigma : float
        Standard deviation of a pulse's angle, rad.
    begin : float
        s of the record, from which on all this holds; minus infinity where the shaft turned so before its first sample.
    signal_over_pulses : float
        How many times the keyphasor's speed the speed signal reads, where the two contradict each other; 1 elsewhere.
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
        """Angle turned at times t (n,), s, from the release, rad; after it as fast as there."""
        return self.omega * t + 0.5 * self.acceleration * np.minimum(t, 0.0) ** 2


def fit_turning(laid: xr.Dataset, machine: Machine, release: float, name: str) -> Turning:
    """Fit the shaft's angle before the release to keyphasor and speed signal.

    Parameters
    ----------
    laid : Dataset
        A record laid over its machine.
    machine : Machine
    release : float
        s.
    name : str
        What an error calls the record.

    Raises
    ------
    InputError
        If neither tells the speed before the release.
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
    parts += _by_speed(laid, release, begin)
    if not parts:
        raise InputError(
            f"{name}: neither keyphasor nor speed signal tells the speed before the release, which the model needs: record a"
            " keyphasor, or the speed at the probes' rate, or 4 times at least in the levitated stretch"
        )
    if not keyed:  # then any angle will do
        parts.append((np.array([[1.0, 0.0, 0.0]]), np.zeros(1)))
    design, target = (np.concatenate(each) for each in zip(*parts, strict=True))
    over = 1.0
    if marks is not None and keyed:
        tick = math.sqrt(12) * marks.sigma / float(np.ptp(times[before]))
        over, design = _scaled_by_pulses(design, target, before.sum(), tick)
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
    """Whether pulses are all rounded to samples alike, as what is left of them (n,) tells: no mean of them helps then."""
    freedom = len(left) - _FEWEST_PULSES
    return freedom >= _SCATTER_TOLD and float(left @ left) < _ALIKE * freedom


def _scaled_by_pulses(design: Array, target: Array, pulses: int, tick: float) -> tuple[float, Array]:
    """Return by how many times a speed signal reads too much by the pulses, and the rows of a fit with its scale free.

    One and the rows as they are where the two agree: within their noise, and within what the pulses' rounding may drift by.

    Parameters
    ----------
    design, target : (n, 3) and (n,) arrays
        Rows of so many pulses, and after them of the signal.
    pulses : int
    tick : float
        Share of the time between the first pulse and the last that a pulse is rounded to.
    """
    if len(target) == pulses:
        return 1.0, design
    freed = np.column_stack([design, np.where(np.arange(len(target)) < pulses, 0.0, target)])
    solution, *_ = np.linalg.lstsq(freed, target, rcond=None)
    left = (target - freed @ solution)[:pulses]
    # pulses may scatter by more than their rounding
    loose = max(1.0, float(left @ left) / max(pulses - _FEWEST_PULSES, 1))
    surplus, sigma = float(solution[3]), math.sqrt(loose * float(np.linalg.pinv(freed.T @ freed)[3, 3]))
    if abs(surplus) <= max(_PLAINLY * sigma, tick):
        return 1.0, design
    return 1 / (1 - surplus), freed


def _even_since(marks: Pulses, release: float) -> tuple[float, float]:
    """Return since when one acceleration fits the pulses, s, and the factor of their noise."""
    turns = between(marks).between(-math.inf, release)
    even, factor = last_even_turns(turns, marks.sigma)
    return -math.inf if len(even) == len(turns) else float(even.begin[0]), factor


def _even_speed_since(laid: xr.Dataset, release: float) -> float:
    """Return since when one acceleration fits the speed signal, s."""
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


def _by_speed(laid: xr.Dataset, release: float, begin: float) -> list[tuple[Array, Array]]:
    """Return rows (n, 3) over turns, turns/s and half the acceleration, and their values (n,), of the speed before a release."""
    if "speed" not in laid:
        return []
    channel = laid["speed"]
    at = times_of(channel) - release
    keep = (at < 0) & (at >= begin - release) & np.isfinite(channel.values)
    at, hz = at[keep], channel.values[keep]
    held = float(channel.attrs.get(HELD, 0.0))
    if len(hz) <= (_FEWEST_HELD if held else _FEWEST_SPEEDS):
        return []
    at = at - held / 2  # a value that is held was read up to so long before, half of it on average
    slope = np.polyfit(at, hz, 1)
    spread = max(_spread(hz - np.polyval(slope, at)), _LEAST_SPREAD * float(np.mean(hz)))
    # by how old they are all are wrong alike: no mean helps
    spread = math.hypot(spread, math.sqrt(len(hz)) * held / 2 * abs(float(slope[0])))
    return [(np.column_stack([np.zeros_like(at), np.ones_like(at), 2 * at]) / spread, hz / spread)]


def _spread(left: Array) -> float:
    """Return the standard deviation of what a line leaves of samples (n,); of those that err alike, as if they did not.

    A signal that is smoothed errs alike for many samples, and means of blocks scatter more than samples let expect.
    """
    alone, size = float(np.std(left, ddof=2)), len(left) // _BLOCKS
    if size < 2:
        return alone
    means = left[: size * _BLOCKS].reshape(_BLOCKS, size).mean(axis=1)
    slow = math.sqrt(size) * float(np.std(means, ddof=2))
    return slow if slow > _SLOWLY * alone else alone
