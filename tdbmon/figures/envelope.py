"""Decimation of a long signal for display without losing peaks: minimum and maximum of each bin."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.unbroken import pieces


def envelope(values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Return minimum and maximum of nearly equal bins of consecutive samples, each (bins,).

    Parameters
    ----------
    values : ndarray (n,)
        NaN values are ignored; a bin of NaN only is NaN.
    bins : int
        At most n.
    """
    edges = np.linspace(0, len(values), bins + 1).astype(int)[:-1]
    return np.fmin.reduceat(values, edges), np.fmax.reduceat(values, edges)


def envelope_line(time: np.ndarray, values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a line through minimum and maximum of each bin; the signal itself if it has at most 2 * bins samples.

    A gap in the time axis breaks the line by a NaN, and no bin spans it.
    """
    whole = pieces(time)
    if len(whole) == 1:
        return _line(time, values, bins)
    lines = [_line(time[each], values[each], max(1, bins * (each.stop - each.start) // len(time))) for each in whole]
    ends = [np.append(line, np.nan) for _, line in lines]
    return np.concatenate([np.append(at, at[-1]) for at, _ in lines])[:-1], np.concatenate(ends)[:-1]


def _line(time: np.ndarray, values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    if len(values) <= 2 * bins:
        return time, values
    low, high = envelope(values, bins)
    edges = np.linspace(0, len(values), bins + 1).astype(int)[:-1]
    return np.repeat(time[edges], 2), np.column_stack([low, high]).ravel()
