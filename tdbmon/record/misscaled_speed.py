"""Detection of a scale error of a few per cent in a speed signal, from the 1X line of the levitated shaft.

Such a small error is within the width of a spectral line: in 0.1 s, lines 10 Hz apart merge.  But the frequency of a single
line can be estimated to a small fraction of its width.  The line is sought along the trend of the speed signal, as a
decreasing speed gives no sharp line.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.record.levitated_lines import STANDS_OUT, STRONG, WIDTH, LevitatedLines, vertex
from tdbmon.record.samples import known_samples

_OFF = 0.02  # of the speed: smaller errors are handled in the analysis of the release
_REACH = 0.15  # of the speed: search range for the 1X line
_STEP = 0.1  # bins between the trial scales


def true_speed(ds: xr.Dataset, lines: LevitatedLines, stated: float) -> float | None:
    """Return the speed of the levitated shaft if it is close to, but different from, the stated one.

    Parameters
    ----------
    ds : xarray.Dataset
        Record with the channel "speed", Hz.
    lines : LevitatedLines
        Spectrum of the same record.
    stated : float
        Initial reading of the speed signal, Hz.

    Returns
    -------
    float or None
        Speed, Hz; None if the signal is confirmed, or the record is inconclusive.
    """
    turns = _turns(ds, lines.time, stated)
    if turns is None:
        return None
    reach = max(WIDTH, _REACH * stated / lines.cell)
    cells = np.arange(-reach, reach + _STEP / 2, _STEP)
    scales = 1 + cells * lines.cell / stated
    power = np.array([_power(lines.levels, scale * turns) for scale in scales])
    top = int(np.argmax(power))
    if not 0 < top < len(scales) - 1:
        return None
    scale = float(scales[top] + vertex(power[top - 1 : top + 2]) * (scales[1] - scales[0]))
    usual = lines.usual(stated)
    if abs(scale - 1) < _OFF or not 0 < STRONG * usual < power[top]:
        return None
    beside = _without(lines.levels, scale * turns)
    return scale * stated if _power(beside, turns) < STANDS_OUT * usual else None


def _turns(ds: xr.Dataset, time: np.ndarray, stated: float) -> np.ndarray | None:
    """Return the shaft angle in the levitated stretch, revolutions, from a straight line fitted to the speed signal."""
    at, hz = known_samples(ds["speed"])
    near = (at >= time[0]) & (at <= time[-1])
    if near.sum() < 2:
        return None
    middle = float(np.mean(at[near]))
    slope = np.polyfit(at[near] - middle, hz[near], 1)[0] if np.ptp(at[near]) > 0 else 0.0
    since = time - time[0]
    return np.asarray(stated * since + 0.5 * slope * since**2)


def _power(levels: np.ndarray, turns: np.ndarray) -> float:
    """Return the power at the instantaneous phase `turns`, revolutions, summed over all probes, with the Hann window."""
    wave = np.hanning(turns.size) * np.exp(-2j * np.pi * turns)
    return float(np.sum(np.abs(levels @ wave) ** 2))


def _without(levels: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the displacements (probes, n) minus the fitted line with the instantaneous phase `turns`, revolutions."""
    wave = np.column_stack([np.ones_like(turns), np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)])
    window = np.hanning(turns.size)[:, None]
    fitted, *_ = np.linalg.lstsq(window * wave, window * levels.T, rcond=None)
    return np.asarray(levels - (wave @ fitted).T)
