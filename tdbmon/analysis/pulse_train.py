"""The keyphasor's pulses as a measure of speed: exact in scale and zero, timed to one sample."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.drag_law import Coast
from tdbmon.estimate import Z95, Estimate

_COMPARED = 60  # pulses: few carry all that the comparison needs
_FEWEST = 24  # block means
_MISCOUNTED = 0.5  # turns
_LEAP, _OUT = 0.03, 10.0  # turns, and standard deviations of the others


def compare_with_pulses(
    after: Coast, turns: Coast, step: float, with_zero: bool, delay: float
) -> tuple[Estimate, tuple[float, float] | None]:
    """Compare the speed signal's revolutions with the pulses counted.

    Generalised least squares: a pulse is timed to a sample, the summed noise of the signal is a random walk.  The rounding to
    samples is not random where a turn lasts nearly whole samples: it may drift by one over the train, by which the interval of
    the ratio is wider.  A miscounted turn, as of pulses shorter than a sample, would pass for a share of the scale: where the
    two part by half a turn from one pulse to the next, there is no ratio; nor where samples that were lost make them leap
    apart by less.

    Parameters
    ----------
    after : Coast
        Block means of the speed signal after the release.
    turns : Coast
        Mean speeds between pulses.
    step : float
        Sampling period, s.
    with_zero : bool
        Whether the rotor comes to rest in the record, so that the signal's zero can be told from its scale.
    delay : float
        By how much the signal's times may be off either way, s.

    Returns
    -------
    ratio : Estimate
        Revolutions a pulse.
    zero : (float, float) or None
        The signal's reading at rest and its standard deviation, Hz, if asked for.
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
    bend = np.abs(np.gradient(speeds, times)) * block**2 / 8  # of the curve within a block
    scatter = float(np.var(np.diff(after.mean, 2)) / 6) * block  # rev^2 a second
    since = times - times[0]
    covariance = np.diag((speeds * step) ** 2 / 12 + bend**2) + scatter * np.minimum.outer(since, since)
    covariance += (0.5 * step) ** 2 * np.outer(speeds, speeds)  # where within its sample an edge is timed is not known
    columns = np.column_stack([counted, np.ones(len(times)), *([since] if with_zero else [])])
    weight = np.linalg.inv(np.linalg.cholesky(covariance))
    solution, *_ = np.linalg.lstsq(weight @ columns, weight @ turned, rcond=None)
    apart = each @ [solution[0], -1.0, solution[2] if with_zero else 0.0]
    parted = (np.abs(apart) > _MISCOUNTED) | _leapt(apart, each[:, 2], float(speeds[0]) * step)
    if parted.any():
        why = (
            f"the keyphasor's pulses are not one a turn by the speed signal in {parted.sum()} of {len(parted)} intervals, the"
            f" first at {turns.begin[parted][0]:.4g} s: some were missed or surplus, or samples were lost there"
        )
        return Estimate.missing("1", why), None
    sigma = np.sqrt(np.diag(np.linalg.pinv((weight @ columns).T @ (weight @ columns))))
    method = "revolutions of the speed signal over pulses counted"
    value, half = float(solution[0]), Z95 * float(sigma[0]) + step / float(since[-1])
    half += delay * abs(float(speeds[0] - speeds[-1])) / float(counted[-1])
    ratio = Estimate(value, value - half, value + half, "1", method)
    return ratio, (float(solution[2]), float(sigma[2])) if with_zero else None


def _leapt(apart: np.ndarray, seconds: np.ndarray, sample: float) -> np.ndarray:
    """Return which intervals (n,) part far more than the others, where `sample` is a sample in turns.

    Long ones, of a shaft that comes to rest, are not judged: they hold more of the signal's noise.
    """
    off = np.abs(apart - np.median(apart))
    limit = max(_LEAP, 3 * sample, _OUT * 1.4826 * float(np.median(off)))
    return np.asarray((off > limit) & (seconds < 2 * np.median(seconds)))
