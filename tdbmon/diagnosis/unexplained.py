"""What the best model leaves: how much, in which probe, when, and at which frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdbmon.diagnosis.contest import Contender
from tdbmon.identify.prediction import predict, readings

Array = NDArray[np.float64]

_SPAN_S = 0.004  # of which the loudest is named


@dataclass(frozen=True)
class Unexplained:
    """The loudest of what is left.

    Attributes
    ----------
    drop, probe : str
        Where it is loudest.
    rms, noise : float
        There, over the time that was fitted, m.
    since, until : float
        When, s after the release.
    frequency : float
        Of the strongest component there, Hz.
    ratio : float
        Misfit a residual of all drops: 1 where only noise is left.
    """

    drop: str
    probe: str
    rms: float
    noise: float
    since: float
    until: float
    frequency: float
    ratio: float


def unexplained(contender: Contender) -> Unexplained:
    """Return what a model leaves."""
    loudest: tuple[float, int, int, Array, Array] | None = None
    for drop in range(len(contender.problem.drops)):
        since, left = residual(contender, drop)
        for row, noise in enumerate(contender.problem.drops[drop].noise):
            over = float(np.std(left[row])) / noise.sigma
            if loudest is None or over > loudest[0]:
                loudest = (over, drop, row, since, left[row])
    if loudest is None:  # a problem has a drop, and a drop has probes
        raise ValueError("a contender without drops")
    _, drop, row, since, series = loudest
    measured = contender.problem.drops[drop]
    width = max(2, round(_SPAN_S / measured.interval))
    power = np.convolve(series**2, np.ones(width), "valid")
    begin = int(np.argmax(power))
    spectrum = np.abs(np.fft.rfft((series - series.mean()) * np.hanning(len(series)), 8 * len(series)))
    frequency = float(np.fft.rfftfreq(8 * len(series), measured.interval)[int(np.argmax(spectrum))])
    return Unexplained(
        drop=measured.name,
        probe=measured.probes[row].name,
        rms=math.sqrt(float(np.mean(series**2))),
        noise=measured.noise[row].sigma,
        since=float(since[begin]),
        until=float(since[min(begin + width, len(since) - 1)]),
        frequency=frequency,
        ratio=contender.ratio,
    )


def residual(contender: Contender, drop: int) -> tuple[Array, Array]:
    """Return s after the release (k,), and measured less simulated (probes, k), m, up to the horizon."""
    problem, measured = contender.problem, contender.problem.drops[drop]
    shared, own = problem.values(contender.fit.point, drop)
    model, effects = problem.setting(shared, own, drop)
    prediction = predict(measured, model, own, contender.horizon)
    seen = readings(prediction, measured, problem.model.machine, problem.sensors(effects, shared, own, drop))
    span = slice(prediction.first, prediction.first + seen.shape[1])
    since = measured.time[span] - measured.release
    after = since >= 0
    return since[after], (measured.reading[:, span] - seen)[:, after]
