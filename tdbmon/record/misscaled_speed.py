"""A speed signal whose scale is off by some per cent, as the levitated shaft shows where nothing counts its turns.

So small an error lies within a line's width: in a tenth of a second, lines 10 Hz apart are one.  Yet where the shaft draws one
line alone, its phase tells its frequency to a small part of that.  The signal's own course is followed, as a speed that falls
draws no sharp line.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.record.levitated_lines import STANDS_OUT, STRONG, WIDTH, LevitatedLines, vertex
from tdbmon.record.samples import known_samples

_OFF = 0.02  # of the speed: less is followed by the analysis of the release
_REACH = 0.15  # of the speed: so far the shaft's line is sought
_STEP = 0.1  # cells between the scales that are tried


def true_speed(ds: xr.Dataset, lines: LevitatedLines, stated: float) -> float | None:
    """Return the speed that the levitated shaft turns with, where it is near the stated one and yet another.

    Parameters
    ----------
    ds : xarray.Dataset
        With the channel "speed", Hz.
    lines : LevitatedLines
        Of the same record.
    stated : float
        What the speed signal reads at first, Hz.

    Returns
    -------
    float or None
        Hz; None where the signal is borne out, or nothing is told.
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
    """Angle of the shaft over the levitated stretch by the speed signal, revolutions: its course is a straight line there."""
    at, hz = known_samples(ds["speed"])
    near = (at >= time[0]) & (at <= time[-1])
    if near.sum() < 2:
        return None
    middle = float(np.mean(at[near]))
    slope = np.polyfit(at[near] - middle, hz[near], 1)[0] if np.ptp(at[near]) > 0 else 0.0
    since = time - time[0]
    return np.asarray(stated * since + 0.5 * slope * since**2)


def _power(levels: np.ndarray, turns: np.ndarray) -> float:
    """Power of a line that turns so, over all probes, by the window of the spectrum."""
    wave = np.hanning(turns.size) * np.exp(-2j * np.pi * turns)
    return float(np.sum(np.abs(levels @ wave) ** 2))


def _without(levels: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the displacements (probes, n) without a line that turns so."""
    wave = np.column_stack([np.ones_like(turns), np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)])
    window = np.hanning(turns.size)[:, None]
    fitted, *_ = np.linalg.lstsq(window * wave, window * levels.T, rcond=None)
    return np.asarray(levels - (wave @ fitted).T)
