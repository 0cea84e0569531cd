"""Features of a whole coast-down, measured beside simulated: decay of speed and motion, resonances, lines."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdbmon.analysis.lines import Line
from tdbmon.analysis.result import Analysis
from tdbmon.estimate import Estimate
from tdbmon.identify.coast_down import CoastDown
from tdbmon.identify.natural_frequencies import ORDERS, NaturalFrequencies

Array = NDArray[np.float64]

_WINDOW_S = 1.0
SPEED_APART = 0.01  # of the measured speed
MOTION_APART = 1.5  # ratio of the rms, or its inverse
_LEAST_PRESENT = 0.5  # of a window's samples, that must be present
_SLOWEST = 0.02  # of the greatest speed: at lower ones a relative difference means nothing
_STANDS_OUT = 2.0  # times the median around it: least height of a peak
_SAME = 0.01  # relative, of the frequencies or orders of lines without a common name
_AROUND = 0.1  # of a critical speed, within which the peak is sought


@dataclass(frozen=True, eq=False)
class Course:
    """Speed and motion in windows of 1 s from the release (SI).

    Attributes
    ----------
    time : (k,) array
        Middle of each window, s after the release.
    measured_speed, simulated_speed : (k,) arrays
        Mean, Hz; NaN where no speed is known.
    turning : (k,) array
        True where the measured speed is high enough for a relative difference.
    measured_rms, simulated_rms : dict
        By the end's name, rms of x and y about their means (2, k), m; NaN where samples are missing.
    speed_parts, motion_parts : float or None
        s after the release at which measured and simulated speed first differ by more than `SPEED_APART`, and the rms of the
        motion (both ends and directions together) by more than a factor of `MOTION_APART`, even if they agree again later; None
        where they never do.
    """

    time: Array
    measured_speed: Array
    simulated_speed: Array
    turning: NDArray[np.bool_]
    measured_rms: dict[str, Array]
    simulated_rms: dict[str, Array]
    speed_parts: float | None
    motion_parts: float | None


@dataclass(frozen=True)
class Resonance:
    """An order of rotation that met a natural frequency.

    Attributes
    ----------
    mode : int
        Of the natural frequencies, from 0.
    order : float
    critical : float
        Computed speed at which they meet, Hz.
    measured, simulated : tuple of float or None
        Speed, Hz, and amplitude, m 0-pk, of the peak of the order's circular component; None where no peak stands out, or the
        order was not tracked.
    """

    mode: int
    order: float
    critical: float
    measured: tuple[float, float] | None
    simulated: tuple[float, float] | None


def course(whole: CoastDown) -> Course:
    """Return speed and motion of both records in windows."""
    both = [_windows(each) for each in (whole.measured, whole.simulated)]
    count = min(len(each[0]) for each in both)
    time = both[0][0][:count]
    speeds = [each[1][:count] for each in both]
    motions = [{end: rms[:, :count] for end, rms in each[2].items()} for each in both]
    with np.errstate(invalid="ignore"):
        turning = speeds[0] > _SLOWEST * np.nanmax(speeds[0]) if np.isfinite(speeds[0]).any() else np.zeros(count, bool)
        speed_apart = turning & (np.abs(speeds[1] / np.where(turning, speeds[0], 1.0) - 1) > SPEED_APART)
    shared = [end for end in motions[0] if end in motions[1]]
    total = [np.sqrt(sum((np.sum(m[end] ** 2, axis=0) for end in shared), np.zeros(count))) for m in motions]
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = total[1] / total[0]
    return Course(
        time=time,
        measured_speed=speeds[0],
        simulated_speed=speeds[1],
        turning=turning,
        measured_rms=motions[0],
        simulated_rms=motions[1],
        speed_parts=_first(time, speed_apart),
        motion_parts=_first(time, (ratio > MOTION_APART) | (ratio < 1 / MOTION_APART)),
    )


def resonances(whole: CoastDown, natural: NaturalFrequencies) -> tuple[Resonance, ...]:
    """Return the resonances that the coast-down passed, in that order.

    Those above the speed at the release are left out: the natural frequencies may belong to several drops, one of them faster.
    """
    fastest = _at_release(whole.measured)
    found = [
        Resonance(k, order, speed, _peak(whole.measured, order, speed), _peak(whole.simulated, order, speed))
        for k, mode in enumerate(natural.modes)
        for order, speed in zip(ORDERS, mode.critical, strict=True)
        if speed is not None and speed <= fastest
    ]
    return tuple(sorted(found, key=lambda each: -each.critical))


def paired_lines(whole: CoastDown) -> list[tuple[str, Line | None, Line | None]]:
    """Return measured and simulated lines, paired by name, else by frequency or order; None where one record lacks the line."""
    measured, simulated = ({line.name: line for line in each.lines} for each in (whole.measured, whole.simulated))
    rows = []
    for name, line in measured.items():
        partner = simulated.pop(name, None) or next((each for each in simulated.values() if _same(line, each)), None)
        if partner is not None:
            simulated.pop(partner.name, None)
        rows.append((name, line, partner))
    return [*rows, *((name, None, line) for name, line in simulated.items())]


def _same(one: Line, other: Line) -> bool:
    """True for lines of the same kind at nearly the same order or frequency."""
    if one.kind != other.kind:
        return False
    places = [line.order if line.order is not None else line.frequency.value or 0.0 for line in (one, other)]
    return abs(places[1] - places[0]) < _SAME * abs(places[0])


def scalars(whole: CoastDown) -> list[tuple[str, Estimate, Estimate]]:
    """Return the scalar results of both analyses, by name."""
    rows: list[tuple[str, Estimate, Estimate]] = []
    a, b = whole.measured, whole.simulated
    if a.rundown is not None and b.rundown is not None:
        for name, field in (
            ("Speed at the release", "initial"),
            ("Speed lost to contacts and ring spin-up", "lost_speed"),
            ("Decay time of the linear term", "decay_time"),
            ("Torque of the constant drag", "drag_torque"),
            ("Standstill", "standstill_time"),
        ):
            rows.append((name, getattr(a.rundown, field), getattr(b.rundown, field)))
    for k in range(2):
        rows.append((f"Swing {k + 1}, small", a.swings[k], b.swings[k]))
    for end in a.ends:
        if end in b.ends:
            rows.append((f"{end}: radius at rest", a.ends[end].circle.radius, b.ends[end].circle.radius))
    return rows


def _windows(analysis: Analysis) -> tuple[Array, Array, dict[str, Array]]:
    """Return middle, mean speed and rms of the motion of windows from the release on."""
    planes = analysis.planes
    if planes is None:
        return np.empty(0), np.empty(0), {}
    time = planes.time.to_numpy()
    release = analysis.released
    begin = float(time[np.searchsorted(time, time[0] if release is None else release)])
    step = 1 / float(planes.attrs["sampling_hz"])
    count = int((time[-1] + 1.5 * step - begin) / _WINDOW_S)
    edges = begin + _WINDOW_S * np.arange(count + 1)
    middle = _WINDOW_S * (np.arange(count) + 0.5)
    samples = list(itertools.pairwise(np.searchsorted(time, edges - step / 2)))
    rms: dict[str, Array] = {}
    for end in planes.end.values:
        xy = planes.displacement.sel(end=end).to_numpy()
        if np.isfinite(xy).any():
            rms[str(end)] = np.full((2, count), np.nan)
            for k, (low, high) in enumerate(samples):
                if (
                    high - low
                ) * step > _LEAST_PRESENT * _WINDOW_S:  # else a hole in the time axis took most of the window
                    rms[str(end)][:, k] = xy[:, low:high].std(axis=1)
    inside = np.searchsorted(analysis.speed_time, edges)
    speed = [
        float(np.mean(analysis.speed_hz[low:high])) if high > low else np.nan
        for low, high in itertools.pairwise(inside)
    ]
    return np.asarray(middle, dtype=float), np.array(speed), rms


def _first(time: Array, apart: NDArray[np.bool_]) -> float | None:
    """Return the start of the first window in which the two records differ."""
    at = np.flatnonzero(apart)
    return float(time[at[0]] - _WINDOW_S / 2) if at.size else None


def _at_release(analysis: Analysis) -> float:
    """Return the speed at the release, Hz, or the greatest known one; infinite where none is known."""
    if analysis.rundown is not None and analysis.rundown.initial.value is not None:
        return analysis.rundown.initial.value
    return float(np.max(analysis.speed_hz)) if len(analysis.speed_hz) else math.inf


def _peak(analysis: Analysis, order: float, critical: float) -> tuple[float, float] | None:
    tracks = analysis.tracks
    if tracks is None or order not in tracks.order.values:
        return None
    part = tracks.sel(order=order)
    speed = part.speed.to_numpy()
    circle = np.fmax(part.forward.to_numpy(), part.backward.to_numpy()).max(axis=part.forward.get_axis_num("end"))
    # a rotor that still bounces at a critical speed shows no resonance of the resting rotor
    settled = [end.gap.settled_from for end in analysis.ends.values() if end.gap is not None]
    resting = part.time.to_numpy() > max(settled, default=-math.inf)
    circle = np.where(np.isfinite(circle) & resting, circle, 0.0)
    near = np.flatnonzero(np.abs(speed / critical - 1) < _AROUND)
    wide = circle[np.abs(speed / critical - 1) < 3 * _AROUND]
    if len(near) < 3 or not wide.any():
        return None
    at = int(np.argmax(circle[near]))
    inside = 0 < at < len(near) - 1
    found = float(circle[near[at]])
    return (float(speed[near[at]]), found) if inside and found > _STANDS_OUT * np.median(wide[wide > 0]) else None
