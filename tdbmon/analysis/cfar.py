"""Detection of persistent spectral lines at a constant false-alarm rate (CFAR).

A cell of a time-frequency map is a detection when it is a local maximum over frequency and exceeds the local noise: it lies
above ``T`` times the median of the reference cells below and of those above it in frequency (the greater counts, so that the
edge of a slope or of a plateau raises no alarm).  ``T`` follows from the required rate for exponentially distributed noise power
(order-statistic CFAR: H. Rohling, IEEE Trans. Aerosp. Electron. Syst. 19, 1983, 608-621; greatest-of: V. G. Hansen and
J. H. Sawyers, ibid. 16, 1980, 115-118).  A line must be detected in m of n windows (binary integration; M. Schwartz,
IRE Trans. Inf. Theory 2, 1956, 135-139), with a rate per cell such that at most one
record of noise in a hundred raises an alarm.
"""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np

GUARD = 4  # guard cells to each side of the cell under test: the main lobe of the Blackman-Harris window
REFERENCE = 24  # reference cells of noise to each side
_FEWEST = 6  # reference cells at the lower end of the spectrum
_NOISE_BANDWIDTH = 2.0  # equivalent noise bandwidth of the window, bins: so many neighbouring cells count as one
FIRST = 1 + _FEWEST + GUARD  # the lowest cell under test
LAST = GUARD + REFERENCE  # cells at the upper end that serve as reference only

WINDOWS, HITS = 8, 4  # a line is detected in 4 of 8 windows
RECORD_RATE = 0.01  # false alarms per record of noise


def cell_rate(cells: int) -> float:
    """Return the false-alarm rate per cell for which a map of `cells` noise cells has the false-alarm rate `RECORD_RATE`.

    A hit may lie one cell to either side, and every window may begin a run of `WINDOWS`.
    """

    def record(p: float) -> float:
        q = min(1.0, 3 * p)
        return cells * sum(comb(WINDOWS, i) * q**i * (1 - q) ** (WINDOWS - i) for i in range(HITS, WINDOWS + 1))

    low, high = 1e-12, 0.2
    for _ in range(60):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if record(middle) < RECORD_RATE else (low, middle)
    return float(low)


@cache
def multiplier(cells: int, rate: float) -> float:
    """Return the threshold relative to the median of `cells` cells of exponential noise for a false-alarm rate (Rohling)."""
    independent = max(2, int(cells / _NOISE_BANDWIDTH))
    left = independent - np.arange((independent + 1) // 2)
    wanted, threshold = np.log(rate), 0.0
    for _ in range(50):  # Newton steps from below converge: the logarithm of the rate is convex and decreasing
        excess = np.sum(np.log(left / (left + threshold))) - wanted
        threshold += excess / np.sum(1 / (left + threshold))
        if excess < 1e-9:
            break
    return float(threshold)


def _noise_floor(power: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the median power of the reference cells to the left and to the right of each cell.

    Parameters
    ----------
    power : ndarray, shape (windows, cells)

    Returns
    -------
    left, right : ndarray, shape (windows, cells - LAST - FIRST)
        For the cells under test, from `FIRST` on.
    """
    cells = power.shape[1] - LAST - FIRST
    stride = 8  # a running median every eighth cell is enough
    view = np.lib.stride_tricks.sliding_window_view(power.astype(np.float32), REFERENCE, axis=1)[:, 1::stride]
    running = np.repeat(np.median(view, axis=2), stride, axis=1)  # column k: of the reference cells from 1 + k on
    target = FIRST + np.arange(cells)
    right = running[:, np.minimum(target + GUARD + stride - 1, running.shape[1] - 1)]
    begin = target - GUARD - REFERENCE - 1
    left = running[:, np.maximum(begin, 0)]
    for i in np.flatnonzero(begin < 0):
        left[:, i] = np.median(power[:, 1 : target[i] - GUARD], axis=1)
    return left, right


def detect(power: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Detect the cells that exceed the local noise, and estimate that noise.

    Parameters
    ----------
    power : ndarray, shape (windows, cells)
        NaN where a window could not be transformed.
    rate : float
        False-alarm rate per cell.

    Returns
    -------
    found : ndarray of bool, shape (windows, cells)
    floor : ndarray, shape (windows, cells)
        Mean noise power beside each cell (NaN outside the cells under test).
    """
    found, floor = np.zeros(power.shape, dtype=bool), np.full(power.shape, np.nan)
    if power.shape[1] <= FIRST + LAST + 1:
        return found, floor
    left, right = _noise_floor(power)
    looked = slice(FIRST, power.shape[1] - LAST)
    here = power[:, looked]
    counts = np.minimum(REFERENCE, np.arange(FIRST, power.shape[1] - LAST) - GUARD - 1)
    by_count = {n: multiplier(n, rate) for n in {REFERENCE, *counts.tolist()}}
    threshold = np.maximum(left * np.array([by_count[n] for n in counts.tolist()]), right * by_count[REFERENCE])
    peak = (here >= power[:, FIRST - 1 : -LAST - 1]) & (here > power[:, FIRST + 1 : power.shape[1] - LAST + 1])
    found[:, looked] = peak & (here > threshold)
    floor[:, looked] = (left + right) / (2 * np.log(2))
    return found, floor
