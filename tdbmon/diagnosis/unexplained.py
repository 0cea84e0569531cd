"""The greatest residual of the best model: in which drop and probe, when, and at which frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdbmon.diagnosis.contender import Contender

Array = NDArray[np.float64]

_SPAN_S = 0.004  # length of the interval named


@dataclass(frozen=True)
class Unexplained:
    """The greatest residual, relative to the noise.

    Attributes
    ----------
    drop, probe : str
        Where the residual is greatest.
    rms, noise : float
        Of that probe, over the time that was fitted, m.
    since, until : float
        Interval with the greatest power, s after the release.
    frequency, resolution : float
        Strongest component of that probe's residual, and resolution of the spectrum, Hz.
    ratio : float
        Misfit ratio of all drops: 1 for noise alone.
    """

    drop: str
    probe: str
    rms: float
    noise: float
    since: float
    until: float
    frequency: float
    resolution: float
    ratio: float


def unexplained(contender: Contender) -> Unexplained:
    """Return the greatest residual of a model."""
    drops = contender.problem.drops
    left = [contender.problem.simulated(contender.fit.point, k, contender.horizon) for k in range(len(drops))]

    def times_noise(at: tuple[int, int]) -> float:
        there = _there(left[at[0]].left_after[at[1]])
        return float(np.std(there)) / drops[at[0]].noise[at[1]].sigma if there.size else 0.0

    drop, row = max(((k, i) for k, each in enumerate(drops) for i in range(len(each.noise))), key=times_noise)
    measured, found = drops[drop], left[drop]
    since, series = found.since[found.since >= 0], found.left_after[row]
    width = max(2, round(_SPAN_S / measured.interval))
    there = _there(series)
    # a missing sample counts as zero
    power = np.convolve(np.nan_to_num(series**2), np.ones(width), "valid")
    begin = int(np.argmax(power))
    swing = np.nan_to_num(series - there.mean())
    spectrum = np.abs(np.fft.rfft(swing * np.hanning(len(series)), 8 * len(series)))
    frequency = float(np.fft.rfftfreq(8 * len(series), measured.interval)[int(np.argmax(spectrum))])
    return Unexplained(
        drop=measured.name,
        probe=measured.probes[row].name,
        rms=math.sqrt(float(np.mean(there**2))),
        noise=measured.noise[row].sigma,
        since=float(since[begin]),
        until=float(since[min(begin + width, len(since) - 1)]),
        frequency=frequency,
        resolution=2 / (len(series) * measured.interval),
        ratio=contender.ratio,
    )


def _there(series: Array) -> Array:
    """Return the residual where a sample was measured."""
    return series[np.isfinite(series)]
