"""Since when before a release the shaft turns with one acceleration: a drive may have tripped, or the speed wandered, before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tdbmon.analysis.autoregression import Noise, scatter
from tdbmon.analysis.drag_law import Coast, LawFit, fit_law
from tdbmon.analysis.law_choice import gain_apart

Array = NDArray[np.float64]

_UNIFORM = ("constant",)  # drag: one acceleration
# of a stretch, back from the release, that may follow another course than the rest
_SHARES = (0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7)
_FEWEST = 4  # spans in it
_ROUNDING = 3.0  # times the power of white noise, that the rounding of pulses to samples may have at low frequency
_WHOLE = 0.1  # of a sample, by which turns of nearly whole samples miss them: then the rounding drifts slowly
_OF_WHOLE = 20  # pulses of such turns, that add as much power again
_BLOCKS = 40  # of a speed signal: means over less may err alike
_BENDS = 10.0  # times their scatter from one to the next, by which they miss a line
_ALIKE = 3.0  # times the same scatter, of means over less
_LEAST_SCATTER = 1e-5  # of the speed: no signal is taken for better


def last_even_turns(turns: Coast, sigma: float) -> tuple[Coast, float]:
    """Return the last turns that one acceleration fits, all of them where it fits all, and the factor of their noise.

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
        # pulses may scatter by more than their rounding
        spread = max(_slow_rounding(even, fit, sigma) * sigma, scatter(fit.residual))
        last = _last_part(even, spread)
        if last is None:
            break
        even, factor = last, spread / sigma
    return even, factor


def last_even_means(means: Coast) -> Coast:
    """Return the last means of a speed signal that one acceleration fits, all of them where it fits all."""
    while _bend(means):
        last = _last_part(means, _ALIKE * _scatter(means.mean, means))
        if last is None:
            break
        means = last
    return means


def _last_part(coast: Coast, sigma: float) -> Coast | None:
    """Return the last part of a coast that plainly follows a course of its own, or else None."""
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
    """Return the factor by which the rounding of pulses to samples is larger at low frequency than white noise."""
    samples = 1 / (fit.law.mean_between(turns.begin, turns.end) * np.sqrt(12) * sigma)
    whole = float(np.mean(np.abs(samples - np.round(samples)))) < _WHOLE
    return float(np.sqrt(_ROUNDING + whole * len(turns) / _OF_WHOLE))


def _bend(means: Coast) -> bool:
    """Whether the means of a speed signal plainly miss a line; noise that remembers strays from one too."""
    size = len(means) // _BLOCKS
    if not size or means.mean.min() <= 0:  # nor may a shaft be said to slow that stands
        return False
    left = means.mean - np.polyval(np.polyfit(means.middle, means.mean, 1), means.middle)
    blocks = left[: size * _BLOCKS].reshape(_BLOCKS, size).mean(axis=1)
    return bool(np.std(blocks, ddof=2) > _BENDS * _scatter(blocks, means))


def _scatter(values: Array, means: Coast) -> float:
    """Return the scatter of values (n,) of a speed signal from one to the next, and no less than any signal has."""
    return max(scatter(values), _LEAST_SCATTER * float(np.mean(means.mean)))
