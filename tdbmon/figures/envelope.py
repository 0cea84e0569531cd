"""Thinning a long signal to what a screen can show, without losing a peak: the least and the largest of each bin."""

from __future__ import annotations

import numpy as np


def envelope(values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Return least and largest value of nearly equal bins of consecutive samples, each (bins,).

    Parameters
    ----------
    values : ndarray (n,)
        NaN counts as no value; a bin of nothing else is NaN.
    bins : int
        At most n.
    """
    edges = np.linspace(0, len(values), bins + 1).astype(int)[:-1]
    return np.fmin.reduceat(values, edges), np.fmax.reduceat(values, edges)


def envelope_line(time: np.ndarray, values: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a line through least and largest value of each bin; the signal itself where it has at most 2 * bins samples."""
    if len(values) <= 2 * bins:
        return time, values
    low, high = envelope(values, bins)
    edges = np.linspace(0, len(values), bins + 1).astype(int)[:-1]
    return np.repeat(time[edges], 2), np.column_stack([low, high]).ravel()
