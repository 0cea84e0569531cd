"""Keyphasor: detection of its pulses, reduced to one per revolution, and the shaft angle and speed that follow from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.estimate import Estimate
from tdbmon.record.samples import known_samples, times_of
from tdbmon.record.timebase import before_holes
from tdbmon.runs import runs_of

_NEAR = 6  # intervals on either side, at least one of which contains no missed pulse
_WINDOW = 9  # intervals in the window that gives the typical interval
_SHORT = 0.6  # of the typical interval: below, there is a surplus pulse
_LONG = 1.5  # times the typical interval: above, a pulse was missed
_NO_LEVELS = 0.3  # of the level difference: pure noise split at its middle scatters by 0.37 about the two levels
_LONE, _BRIEF = 5, 20  # largest number of spikes, and longest spike in samples
_WIDE = 0.1  # of the pulses: if no more than this have two samples, pulses are shorter than a sample
_BOUNCE = 0.1  # of the long intervals nearby: an edge that follows this soon belongs to the same pulse
# quantiles of the intervals nearby: with two or three edges per pulse the first is long, the second short
_PASSES, _FEW = 0.75, 0.375


@dataclass(frozen=True)
class Pulses:
    """The keyphasor's pulses after removal of surplus ones.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Time of the edge that marks the shaft angle, s.
    turns : numpy.ndarray of int, shape (n,)
        Revolutions since the first pulse; a missed pulse leaves out a number.
    sigma : float
        Standard deviation of a pulse's time, s.
    missed, extra : int
        Number of missed pulses, and of surplus pulses removed.
    in_holes : int
        Number of missed pulses that fall into gaps of the time axis.
    quality : str
        Summary of the above in words.
    """

    times: np.ndarray
    turns: np.ndarray
    sigma: float
    missed: int
    extra: int
    in_holes: int
    quality: str


def pulses(ds: xr.Dataset, machine: Machine) -> Pulses:
    """Detect the keyphasor's pulses.

    The two levels are estimated from the signal itself.  An edge counts once the signal has crossed a hysteresis band around
    the threshold midway between them; its time is interpolated linearly between the samples around the threshold crossing.
    For a signal of only two values that is half a sample before the first sample of the new level.

    Parameters
    ----------
    ds : xarray.Dataset
        A record assigned to a machine (`tdbmon.record.assign.assign`).
    machine : tdbsim.machine.Machine
        ``keyphasor.edge`` is the edge that marks the angle, ``keyphasor.pulses_per_revolution`` the number of pulses.  If
        there are several, the first and every one whole revolutions later are kept, whatever the spacing of the others; it
        is unknown which of them corresponds to ``keyphasor.angle``.

    Returns
    -------
    Pulses
        Empty if the signal has no pulses; `Pulses.quality` then gives the reason.

    Raises
    ------
    InputError
        If the record or the machine has no keyphasor.
    """
    if machine.keyphasor is None or "keyphasor" not in ds:
        raise InputError(
            f"{ds.attrs.get('source_file', 'record')}: no keyphasor; the machine file needs [keyphasor] channel,"
            " and the record that channel"
        )
    array = ds["keyphasor"]
    time, values = known_samples(array)
    levels = _levels(values)
    if levels is None:
        return _none("the signal has one level only")
    low, high = levels
    level = (values - low) / (high - low)
    noise = _noise_of(level)
    if noise > _NO_LEVELS:
        return _none("the signal is noise, without two levels")
    edges, sigma = _edges(time, level if machine.keyphasor.edge == "rising" else 1.0 - level, noise)
    if edges.size == 0:
        return _none("no edge in the signal")
    kept = _without_extra(_without_bounces(edges))
    extra = int(edges.size - kept.size)
    turns, missed = _turns(kept)
    in_holes = _missed_in_holes(kept, turns, times_of(array))
    seen = kept.size
    count = machine.keyphasor.pulses_per_revolution
    first_of_turn = turns % count == 0
    kept, turns = kept[first_of_turn], turns[first_of_turn] // count
    if sigma is None:
        sigma = _scatter(kept, turns)
    words = _in_words(kept, turns, sigma, missed, extra)
    if kept.size < 2 <= seen:
        words = f"{seen} pulses at {count} per revolution are too few for a speed"
    elif count > 1:
        words += f"; one of {count} per revolution is used, and the zero of the shaft angle may be any of them"
    return Pulses(kept, turns, sigma, missed, extra, in_holes, words)


def pulses_if_any(ds: xr.Dataset, machine: Machine) -> Pulses | None:
    """Return the keyphasor's pulses (see `pulses`); None if the record or the machine has no keyphasor."""
    return pulses(ds, machine) if machine.keyphasor is not None and "keyphasor" in ds else None


def sampling_for_pulses(ds: xr.Dataset, machine: Machine) -> float | None:
    """Return the sampling rate that gives each pulse two samples, Hz; None if pulses are longer than a sampling interval.

    Shorter pulses often fall between two samples, and hardly any has more than one sample.  Their duration is estimated from
    their duty cycle and the highest speed in the record.
    """
    if machine.keyphasor is None or "keyphasor" not in ds:
        return None
    array = ds["keyphasor"]
    time, values = times_of(array), array.values
    levels = _levels(values[np.isfinite(values)])
    if levels is None:
        return None
    high = values > sum(levels) / 2
    found = runs_of(high if high.mean() < 0.5 else ~high)  # some sensors give a low pulse at the mark
    if len(found) < _WINDOW or np.mean(found.length > 1) > _WIDE:
        return None
    fastest = 1 / float(np.diff(time[found.first]).min())
    if "speed" in ds and np.isfinite(ds["speed"].values).any():
        fastest = max(
            fastest, machine.keyphasor.pulses_per_revolution * float(np.nanmedian(np.abs(ds["speed"].values)))
        )
    return 2 * fastest * len(values) / found.total


def shaft_angle(pulses: Pulses, time: np.ndarray, machine: Machine) -> np.ndarray:
    """Return the unwrapped shaft angle at given times.

    Between pulses the angle is interpolated by a monotone cubic (PCHIP; F. N. Fritsch and J. Butland, SIAM J. Sci. Stat.
    Comput. 5, 1984, 300-304), so that it never runs backwards.

    Parameters
    ----------
    pulses : Pulses
        Pulses of the record.
    time : numpy.ndarray, shape (n,)
        Times at which the angle is evaluated, s.
    machine : tdbsim.machine.Machine
        ``keyphasor.angle`` is the angle at the pulses; the angle decreases for clockwise rotation.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Angle from +x towards +y in rad; NaN before the first and after the last pulse.
    """
    out = np.full(np.shape(time), np.nan)
    if pulses.times.size < 2:
        return out
    from scipy.interpolate import PchipInterpolator

    mark = machine.keyphasor.angle if machine.keyphasor else 0.0
    inside = (time >= pulses.times[0]) & (time <= pulses.times[-1])
    out[inside] = PchipInterpolator(pulses.times, pulses.turns)(time[inside])
    return mark + machine.sense * 2 * np.pi * out


def speed(pulses: Pulses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mean speed between consecutive pulses.

    Returns
    -------
    time : numpy.ndarray, shape (n - 1,)
        Midpoint of each interval, s.
    hz : numpy.ndarray, shape (n - 1,)
        Revolutions per time, Hz.
    sigma : numpy.ndarray, shape (n - 1,)
        Standard deviation of `hz` due to that of the two edges, ``sqrt(2) sigma hz / interval``; adjacent intervals
        share an edge, so that their errors have a correlation of -1/2.
    """
    if pulses.times.size < 2:
        return np.empty(0), np.empty(0), np.empty(0)
    interval = np.diff(pulses.times)
    hz = np.diff(pulses.turns) / interval
    return (pulses.times[1:] + pulses.times[:-1]) / 2, hz, np.sqrt(2) * pulses.sigma * hz / interval


def stated_over_counted(ds: xr.Dataset, pulses: Pulses, slowest: float = -np.inf) -> tuple[np.ndarray, np.ndarray]:
    """Return the ratio of the speed channel to the keyphasor speed for each revolution, and its standard deviation.

    Only revolutions faster than `slowest`, Hz, count.

    Returns
    -------
    ratio, sigma : numpy.ndarray, shape (n,)
        For the revolutions between the channel's first and last value; `sigma` stems from the timing of the pulses.
    """
    at, hz, sigma = speed(pulses)
    time, stated = known_samples(ds["speed"])
    if not time.size:
        return np.empty(0), np.empty(0)
    inside = (at >= time[0]) & (at <= time[-1]) & (hz > slowest)
    return np.interp(at[inside], time, stated) / hz[inside], sigma[inside] / hz[inside]


def speed_over_pulses(ds: xr.Dataset, machine: Machine) -> Estimate:
    """Return the ratio of the speed channel to the keyphasor speed, which is 1 if both are correct.

    The median over the revolutions, with its standard error from the interquartile range (asymptotic, for normal errors).
    """
    if "speed" not in ds or "keyphasor" not in ds or machine.keyphasor is None:
        return Estimate.missing("1", "the record does not have both a speed channel and keyphasor pulses")
    ratio, _ = stated_over_counted(ds, pulses(ds, machine))
    if len(ratio) < 5:
        return Estimate.missing("1", "fewer than five revolutions have both a stated speed and pulses")
    low, middle, high = np.quantile(ratio, (0.25, 0.5, 0.75))
    error = 1.2533 * float(high - low) / 1.349 / np.sqrt(ratio.size)
    return Estimate.from_sigma(float(middle), float(error), "1", "median over the revolutions")


def _none(why: str) -> Pulses:
    return Pulses(np.empty(0), np.empty(0, dtype=int), np.nan, 0, 0, 0, f"no pulses: {why}")


def _levels(values: np.ndarray) -> tuple[float, float] | None:
    """Return the low and the high level: medians of the samples below and above their midpoint; None if there is one only."""
    if values.size < 2:
        return None
    smallest, largest = float(values.min()), float(values.max())
    low, high = (float(q) for q in np.quantile(values, (0.001, 0.999)))
    if high - low < 0.2 * (largest - smallest):  # pulses in less than a thousandth of the samples
        if (found := _beside_spikes(values)) is not None:
            return found
        low, high = smallest, largest
    if not high > low:
        return None
    for _ in range(8):
        above = values > (low + high) / 2
        if above.all() or not above.any():
            return None
        low, high = float(np.median(values[~above])), float(np.median(values[above]))
    return low, high


def _beside_spikes(values: np.ndarray) -> tuple[float, float] | None:
    """Return the levels of pulses in a signal with a few much larger spikes, as caused by the trip; None otherwise."""
    above = values > (float(values.min()) + float(values.max())) / 2
    spikes = above if above.mean() < 0.5 else ~above
    runs = runs_of(spikes)
    if len(runs) > _LONE or runs.longest > _BRIEF:
        return None
    found = _levels(values[~spikes])
    if found is None:
        return None
    level = (values[~spikes] - found[0]) / (found[1] - found[0])
    pulsed = len(runs_of(level > 0.5)) > max(_WINDOW, 2 * len(runs))
    return found if pulsed and _noise_of(level) < _NO_LEVELS else None


def _edges(time: np.ndarray, level: np.ndarray, noise: float) -> tuple[np.ndarray, float | None]:
    """Return the times of the rising edges from level 0 to 1, and their standard deviation if due to sampling alone."""
    half = float(np.clip(4 * noise, 0.1, 0.4))
    state = np.where(level > 0.5 + half, 1, np.where(level < 0.5 - half, -1, 0))
    known = np.flatnonzero(state)
    rises = np.flatnonzero(np.diff(state[known]) > 0)
    if rises.size == 0:
        return np.empty(0), None
    reached = known[rises + 1]
    below = np.where(level < 0.5, np.arange(level.size), 0)
    before = np.maximum.accumulate(below)[reached]
    after = before + 1
    share = (0.5 - level[before]) / (level[after] - level[before])
    edges = time[before] + share * (time[after] - time[before])
    analogue = (np.abs(level[before] - 0.5) < 0.4) | (np.abs(level[after] - 0.5) < 0.4)
    sampled = float(np.median(time[after] - time[before])) / np.sqrt(12)
    return edges, (None if np.mean(analogue) > 0.5 and edges.size >= 12 else sampled)


def _noise_of(level: np.ndarray) -> float:
    """Return a robust standard deviation of the noise: about the two levels or from first differences, whichever is less.

    Hum and drift cause no edges, and a hysteresis band as wide as they are would miss pulses.
    """
    away = np.abs(level - (level > 0.5))
    steps = np.abs(np.diff(level)) / np.sqrt(2)
    return 1.4826 * min(float(np.median(away)), float(np.median(steps)))


def _usual(intervals: np.ndarray, share: float) -> np.ndarray:
    """Return the moving quantile `share` of the intervals, in a window around each one."""
    n = intervals.size
    width = min(_WINDOW, n)
    windows = np.lib.stride_tricks.sliding_window_view(intervals, width)
    middle = np.quantile(windows, share, axis=1)
    return middle[np.clip(np.arange(n) - width // 2, 0, middle.size - 1)]


def _without_bounces(edges: np.ndarray) -> np.ndarray:
    """Keep the first edge of each pulse if most pulses bounce: the typical interval is then one between bounces."""
    intervals = np.diff(edges)
    if intervals.size < _WINDOW:
        return edges
    long = _usual(intervals, _PASSES)
    bounced = (intervals < _BOUNCE * long) & (_usual(intervals, _FEW) < _BOUNCE * long)
    return edges[np.concatenate(([True], ~bounced))]


def _without_extra(edges: np.ndarray) -> np.ndarray:
    """Remove pulses that follow the previous one much too early: occasional bounces and double pulses."""
    kept = edges
    for _ in range(10):
        if kept.size < 4:
            break
        intervals = np.diff(kept)
        usual = _usual(intervals, 0.5)
        short = np.flatnonzero(intervals < _SHORT * usual)
        # during coast-down, intervals are short relative to later ones: require them to be short relative to earlier ones too
        short = short[(short == 0) | (intervals[short] < _SHORT * np.maximum(intervals[short - 1], usual[short - 1]))]
        short = short[np.diff(short, prepend=-2) > 1]
        if short.size == 0:
            break
        drop = [_surplus(intervals, int(i), float(usual[i])) for i in short]
        kept = np.delete(kept, drop)
    return kept


def _surplus(intervals: np.ndarray, i: int, usual: float) -> int:
    """Return the pulse of the short interval `i` to remove: the one whose removal leaves the more typical interval."""
    if i == 0:
        return 1 if intervals.size > 1 and abs(intervals[0] + intervals[1] - usual) < abs(intervals[1] - usual) else 0
    if i == intervals.size - 1:
        return i + 1
    without_first = abs(intervals[i - 1] + intervals[i] - usual)
    without_second = abs(intervals[i] + intervals[i + 1] - usual)
    return i if without_first < without_second else i + 1


def _turns(times: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the cumulative pulse count and the number missed; an interval of k expected ones contains k - 1 missed pulses.

    If every other pulse is missed five times or more at the record's start, this cannot be told from half the speed.
    """
    n = times.size - 1
    if n < 3:
        return np.arange(times.size), 0
    intervals = np.diff(times)
    steps = np.ones(n, dtype=int)
    for i in np.flatnonzero(intervals[:-1] > _LONG * _usual(intervals, 1 / 3)[:-1]):
        # the shortest interval nearby is a single one even if every other pulse is missed; a rotor coming to rest
        # has only longer ones ahead
        after = np.min(intervals[i + 1 : i + 1 + _NEAR])
        before = np.min(intervals[max(i - _NEAR, 0) : i]) if i else after
        expected = max(before, after)
        if intervals[i] > _LONG * expected:
            steps[i] = max(round(intervals[i] / expected), 1)
    # the last interval has no successor, and as the rotor comes to rest it may be arbitrarily long
    if intervals[-1] > _LONG * (slowest := _next(intervals[:-1] / steps[:-1])):
        steps[-1] = round(intervals[-1] / slowest)
    return np.concatenate(([0], np.cumsum(steps))), int((steps - 1).sum())


def _missed_in_holes(edges: np.ndarray, turns: np.ndarray, time: np.ndarray) -> int:
    """Return how many of the missed pulses fall into gaps of the channel's times (n,), s."""
    within = np.diff(np.searchsorted(before_holes(time), edges)) > 0
    return int((np.diff(turns) - 1)[within].sum())


def _next(intervals: np.ndarray) -> float:
    """Return the longest possible next interval, from the largest recent deceleration; infinite if the rotor may stop first.

    At constant deceleration the square of the speed decreases by the same amount in every revolution.
    """
    square = intervals[-_NEAR:] ** -2.0
    left = square[-1] - 2 * max(float(-np.diff(square).min()), 0.0)
    return float(left**-0.5) if left > 0 else np.inf


def _scatter(times: np.ndarray, turns: np.ndarray) -> float:
    """Return the standard deviation of the pulse times about a smooth trend, from third differences.

    White noise of variance s^2 gives third differences of variance (1 + 9 + 9 + 1) s^2; the median makes it robust.
    """
    third = np.diff(times, 3)[np.diff(turns[1:-1]) == 1] if times.size > 4 else np.empty(0)
    if third.size < 8:
        return float(np.median(np.diff(times))) * 1e-3
    return float(1.4826 * np.median(np.abs(third)) / np.sqrt(20))


def _in_words(times: np.ndarray, turns: np.ndarray, sigma: float, missed: int, extra: int) -> str:
    if times.size < 2:
        return f"{times.size} pulse: too few for a speed"
    hz = np.diff(turns) / np.diff(times)
    faults = [f"{missed} missed" if missed else "", f"{extra} surplus removed" if extra else ""]
    fault = ", ".join(word for word in faults if word) or "none missed, none surplus"
    return f"{times.size} pulses, {hz[0]:.4g} Hz to {hz[-1]:.4g} Hz, {fault}, edges timed to {sigma * 1e6:.2g} us"
