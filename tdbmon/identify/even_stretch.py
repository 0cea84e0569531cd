"""The last stretch before the release with a constant acceleration: earlier the drive may have tripped, or the speed wandered."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tdbmon.analysis.autoregression import Noise, scatter
from tdbmon.analysis.drag_law import Coast, LawFit, fit_law
from tdbmon.analysis.law_choice import gain_apart

Array = NDArray[np.float64]

_UNIFORM = ("constant",)  # drag: one acceleration
# of a stretch, counted back from the release, for which an acceleration of its own is tried
_SHARES = (0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7)
_FEWEST = 4  # spans in such a part
_ROUNDING = 3.0  # low-frequency power of the rounding of pulses to samples, over that of white noise
_WHOLE = 0.1  # of a sample: a turn this close to a whole number of samples makes the rounding error drift slowly
_OF_WHOLE = 20  # turns of this kind that add the power of white noise once more
_BLOCKS = 40  # of a speed signal: means over shorter spans may have correlated errors
_BENDS = 10.0  # times the block-to-block scatter: least deviation from a line that counts as a bend
_ALIKE = 3.0  # times the scatter of means over shorter spans, whose errors may be correlated
_LEAST_SCATTER = 1e-5  # of the speed: no signal is assumed to be better


def last_even_turns(turns: Coast, sigma: float) -> tuple[Coast, float]:
    """Return the last turns that fit a constant acceleration (all where all do), and the factor on their noise.

    Parameters
    ----------
    turns : Coast
        Between pulses up to the release.
    sigma : float
        Standard deviation of a pulse's time, s.
    """
    even, factor = turns, 1.0
    while len(even) > _FEWEST:
        fit = fit_law(even, _UNIFORM, Noise(np.empty(0), sigma))
        # pulses may scatter more than by rounding
        spread = max(_slow_rounding(even, fit, sigma) * sigma, scatter(fit.residual))
        last = _last_part(even, spread)
        if last is None:
            break
        even, factor = last, spread / sigma
    return even, factor


def last_even_means(means: Coast) -> Coast:
    """Return the last means of a speed signal that fit a constant acceleration, all where all do."""
    while _bend(means):
        last = _last_part(means, _ALIKE * _scatter(means.mean, means))
        if last is None:
            break
        means = last
    return means


def _last_part(coast: Coast, sigma: float) -> Coast | None:
    """Return the last part of a coast that clearly has an acceleration of its own; None where there is none."""
    noise = Noise(np.empty(0), sigma)
    fit = fit_law(coast, _UNIFORM, noise)
    last, length = float(coast.end[-1]), float(coast.end[-1] - coast.begin[0])
    most, found = 1.0, None
    for share in _SHARES:
        part = coast.between(last - share * length, last)
        if not _FEWEST <= len(part) < len(coast):
            continue
        gain, limit = gain_apart(coast, fit, noise, coast.begin >= part.begin[0])
        if gain > most * limit:
            most, found = gain / limit, part
    return found


def _slow_rounding(turns: Coast, fit: LawFit, sigma: float) -> float:
    """Return the ratio of low-frequency rounding errors of pulses to white noise of the same standard deviation."""
    samples = 1 / (fit.law.mean_between(turns.begin, turns.end) * np.sqrt(12) * sigma)
    whole = float(np.mean(np.abs(samples - np.round(samples)))) < _WHOLE
    return float(np.sqrt(_ROUNDING + whole * len(turns) / _OF_WHOLE))


def _bend(means: Coast) -> bool:
    """Return whether the means of a speed signal clearly deviate from a line, more than correlated noise would."""
    size = len(means) // _BLOCKS
    if not size or means.mean.min() <= 0:  # a shaft at standstill does not slow down
        return False
    left = means.mean - np.polyval(np.polyfit(means.middle, means.mean, 1), means.middle)
    blocks = left[: size * _BLOCKS].reshape(_BLOCKS, size).mean(axis=1)
    return bool(np.std(blocks, ddof=2) > _BENDS * _scatter(blocks, means))


def _scatter(values: Array, means: Coast) -> float:
    """Return the successive scatter of values (n,) of a speed signal, at least that of the best signal."""
    return max(scatter(values), _LEAST_SCATTER * float(np.mean(means.mean)))
