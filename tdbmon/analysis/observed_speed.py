"""Measured rotor speed before and after a release: block means of a speed signal, or means between keyphasor pulses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tdbmon.analysis.drag_law import Coast
from tdbmon.analysis.pulse_train import compare_with_pulses
from tdbmon.analysis.speed_at_release import lead_of
from tdbmon.analysis.standstill import Rest, find_rest
from tdbmon.analysis.unbroken import longest_stretch, without_holes
from tdbmon.estimate import Estimate
from tdbmon.record.keyphasor import Pulses
from tdbmon.record.keyphasor import speed as pulse_speed
from tdbmon.record.timebase import usual_interval

_BLOCKS = 2000  # at most, after the release
_SAME_SHAFT = 0.05  # relative difference beyond which speed signal and pulses do not belong to the same shaft
NO_PULSES = Estimate.missing("1", "no comparison: the speed signal or the keyphasor is missing")


@dataclass(frozen=True)
class Observed:
    """Mean speeds up to the release and after it, and the standstill.

    `ratio` is revolutions of the speed signal per pulse; `tick` the resolution of the pulse times, s, if the speed is taken from
    pulses; `scale_half` the relative half-width of the confidence interval of the signal's scale, if the pulses set it; `delay`
    the limit of error of the times, either way, s.
    """

    lead: Coast
    after: Coast
    rest: Rest
    source: str
    ratio: Estimate
    tick: float = 0.0
    scale_half: float = 0.0
    delay: float = 0.0


def between(pulses: Pulses) -> Coast:
    """Return the mean speeds between successive pulses; an interval with missed pulses spans two or more revolutions."""
    _, hz, _ = pulse_speed(pulses)
    return Coast(pulses.times[:-1], pulses.times[1:], hz, pulsed=True)


def tick_of(pulses: Pulses | None, time: np.ndarray) -> float:
    """Return the resolution of the pulse times, s: a sampling period, or less if the edges are interpolated between samples."""
    step = usual_interval(time)
    spread = float("nan") if pulses is None else float(np.sqrt(12) * pulses.sigma)
    return min(step, spread) if np.isfinite(spread) else step


def from_pulses(turns: Coast, time: np.ndarray, release: float, tick: float) -> Observed:
    """Return the speed by keyphasor pulses alone, which do not show a standstill; all times in s."""
    last = float(time[-1])
    known = (turns.end - turns.begin)[turns.end <= release]
    begin = release - lead_of(float(np.median(known)) if known.size else 0.0)
    lead, after = turns.between(begin, release), turns.between(release, last)
    return Observed(lead, after, Rest(False, last, last), "keyphasor pulses", NO_PULSES, tick=tick)


def from_signal(time: np.ndarray, signal: np.ndarray, turns: Coast | None, release: float, held: float) -> Observed:
    """Return the block means of a speed signal, which is calibrated against the pulses if there are any.

    Its values may be older than their time stamps by up to `held`, s; the times are corrected by half of that.
    """
    last = float(time[-1])
    step = usual_interval(time)
    lead = without_holes(block_means(time, signal, release - lead_of(step), release, 200), time)
    after = without_holes(block_means(time, signal, release + held, last + step, _BLOCKS), time)
    delay = 0.5 * held
    lead, after = (replace(each, begin=each.begin - delay, end=each.end - delay) for each in (lead, after))
    rest = find_rest(after, turns) if len(after) else Rest(False, last, last)
    ratio, source, gain = NO_PULSES, "speed signal", 1.0
    if turns is not None:
        low, high = longest_stretch(time, release)
        within = after.between(low - step, high + step)
        ratio, zero = compare_with_pulses(within, turns.between(low, high), step, rest.found and high == last, delay)
        gain, source, related = _scale(ratio)
        if zero is not None and related:
            rest = replace(rest, level=zero[0], level_sigma=zero[1], creep=zero[1])
    lead, after = (replace(coast, mean=(coast.mean - rest.level) / gain) for coast in (lead, after))
    after = replace(after, offset_sigma=rest.creep)
    scale_half = 0.0 if gain == 1.0 or ratio.high is None else ratio.high / gain - 1
    return Observed(lead, after, rest, source, ratio, scale_half=scale_half, delay=delay)


def block_means(time: np.ndarray, speed: np.ndarray, low: float, high: float, count: int) -> Coast:
    """Return the means of a speed signal over at most `count` blocks between two times, s; a sample covers one period."""
    first, stop = np.searchsorted(time, [low, high])
    size = max(int(np.ceil((stop - first) / count)), 1)
    blocks = max((stop - first) // size, 0)
    t = time[first : first + blocks * size].reshape(blocks, size)
    v = speed[first : first + blocks * size].reshape(blocks, size)
    good = np.isfinite(v)
    valid = good.sum(axis=1)
    total = np.where(good, v, 0).sum(axis=1, dtype=float)
    half = 0.5 * usual_interval(time)
    use = valid > size // 2
    return Coast(t[use, 0] - half, t[use, -1] + half, total[use] / valid[use])


def _scale(ratio: Estimate) -> tuple[float, str, bool]:
    """Return the scale error of the speed signal, the description of the source, and whether signal and pulses agree."""
    if ratio.value is None or ratio.low is None or ratio.high is None:
        return 1.0, "speed signal", False
    if abs(ratio.value - 1) > _SAME_SHAFT:
        return 1.0, f"speed signal (the keyphasor disagrees: {ratio.value:.3g} revolutions per pulse)", False
    if ratio.low <= 1 <= ratio.high:
        return 1.0, "speed signal, confirmed by the keyphasor", True
    return ratio.value, "speed signal, scaled by the keyphasor", True
