"""Keyphasor pulses as the reference of a speed signal: exact in scale and zero, timed to one sample."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.drag_law import Coast
from tdbmon.estimate import Z95, Estimate

_COMPARED = 60  # pulses used in the fit: so few carry all the information
_FEWEST = 24  # block means
_MISCOUNTED = 0.5  # revolutions
_LEAP, _OUT = 0.03, 10.0  # limits of a jump: revolutions, and robust standard deviations


def compare_with_pulses(
    after: Coast, turns: Coast, step: float, with_zero: bool, delay: float
) -> tuple[Estimate, tuple[float, float] | None]:
    """Return the ratio of the speed signal's revolutions to the pulses counted, by generalised least squares.

    The covariance has the pulse times rounded to a sample and the integrated noise of the signal as a random walk.  The rounding
    is not random if a revolution lasts nearly a whole number of samples: it may drift by one sample over the pulse train, and the
    interval of the ratio includes that.  A miscounted revolution, as with pulses shorter than a sample, would bias the scale: no
    ratio is returned if signal and pulses differ by half a revolution between two pulses, or jump by less because samples were
    lost.

    Parameters
    ----------
    after : Coast
        Block means of the speed signal after the release.
    turns : Coast
        Mean speeds between pulses.
    step : float
        Sampling period, s.
    with_zero : bool
        Whether the rotor comes to rest in the record, so that zero and scale of the signal can be separated.
    delay : float
        Limit of error of the signal's times, either way, s.

    Returns
    -------
    ratio : Estimate
        Revolutions per pulse.
    zero : (float, float) or None
        Zero offset of the signal and its standard deviation, Hz, if requested.
    """
    turns = turns.between(float(after.begin[0]), float(after.end[-1])) if len(after) else turns
    if len(after) < _FEWEST or len(turns) < 6:
        return Estimate.missing("1", "too few pulses after the release to compare with"), None
    at = np.append(after.begin, after.end[-1])
    covered = np.append(0.0, np.cumsum(after.mean * np.diff(at)))
    block = float(np.median(after.end - after.begin))
    counted = np.append(0.0, np.cumsum(np.rint(turns.mean * (turns.end - turns.begin))))
    times, speeds = np.append(turns.begin, turns.end[-1]), np.append(turns.mean, turns.mean[-1])
    turned = np.interp(times, at, covered)
    each = np.column_stack([np.diff(counted), np.diff(turned), np.diff(times)])
    some = np.unique(np.linspace(0, len(times) - 1, _COMPARED).astype(int))
    times, speeds, counted, turned = times[some], speeds[some], counted[some], turned[some]
    bend = np.abs(np.gradient(speeds, times)) * block**2 / 8  # error of linear interpolation within a block
    scatter = float(np.var(np.diff(after.mean, 2)) / 6) * block  # variance of the random walk, rev^2/s
    since = times - times[0]
    covariance = np.diag((speeds * step) ** 2 / 12 + bend**2) + scatter * np.minimum.outer(since, since)
    covariance += (0.5 * step) ** 2 * np.outer(speeds, speeds)  # unknown common offset of the edges within a sample
    columns = np.column_stack([counted, np.ones(len(times)), *([since] if with_zero else [])])
    weight = np.linalg.inv(np.linalg.cholesky(covariance))
    solution, *_ = np.linalg.lstsq(weight @ columns, weight @ turned, rcond=None)
    apart = each @ [solution[0], -1.0, solution[2] if with_zero else 0.0]
    parted = (np.abs(apart) > _MISCOUNTED) | _leapt(apart, each[:, 2], float(speeds[0]) * step)
    if parted.any():
        why = (
            f"by the speed signal, {parted.sum()} of {len(parted)} intervals between keyphasor pulses are not one revolution, the"
            f" first at {turns.begin[parted][0]:.4g} s: pulses were missed or surplus, or samples were lost there"
        )
        return Estimate.missing("1", why), None
    sigma = np.sqrt(np.diag(np.linalg.pinv((weight @ columns).T @ (weight @ columns))))
    method = "revolutions by the speed signal over pulses counted"
    value, half = float(solution[0]), Z95 * float(sigma[0]) + step / float(since[-1])
    half += delay * abs(float(speeds[0] - speeds[-1])) / float(counted[-1])
    ratio = Estimate(value, value - half, value + half, "1", method)
    return ratio, (float(solution[2]), float(sigma[2])) if with_zero else None


def _leapt(apart: np.ndarray, seconds: np.ndarray, sample: float) -> np.ndarray:
    """Return a mask of the intervals (n,) in which signal and pulses differ far more than in the others.

    `sample` is a sampling period in revolutions.  Long intervals, of a shaft coming to rest, are not judged: they accumulate
    more of the signal's noise.
    """
    off = np.abs(apart - np.median(apart))
    limit = max(_LEAP, 3 * sample, _OUT * 1.4826 * float(np.median(off)))
    return np.asarray((off > limit) & (seconds < 2 * np.median(seconds)))
