"""A spectral line of floor or housing vibration before the release: no motion of the shaft, it persists in the fall.

If it is not modelled, its velocity is attributed to the shaft and shifts the release by that over gravity: 8 um at 24 Hz by
0.12 ms.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tdbmon.analysis.left_by_lines import left_by

_CYCLES = 2.0  # in the levitated stretch at least: fewer are drift
_MOST_HZ = 200.0
_STEPS = 4  # search frequencies per bin of the spectrum
_APART = 1.0  # bins at least from lines that are fitted anyway
_SHARE = 0.5  # of the residual power that it must explain: a weaker line hardly shifts the release


def floor_line(t: np.ndarray, data: np.ndarray, fitted_hz: Sequence[float]) -> float | None:
    """Return the frequency of a line far above the noise of the levitated shaft, Hz; None if there is none.

    Parameters
    ----------
    t : (k,) array
        Times of the levitated stretch, s.
    data : (n, k) array
        Displacements, m.
    fitted_hz : sequence of float
        Lines that are fitted anyway.
    """
    from scipy.optimize import minimize_scalar

    if len(t) < 16 or t[-1] == t[0]:
        return None
    cell = 1 / float(t[-1] - t[0])

    def left(lines: Sequence[float]) -> float:
        return left_by(t - t[0], data, lines)

    grid = np.arange(_CYCLES * cell, _MOST_HZ, cell / _STEPS)
    grid = grid[[all(abs(hz - other) > _APART * cell for other in fitted_hz) for hz in grid]]
    if not grid.size:
        return None
    rough = min(grid, key=lambda hz: left([*fitted_hz, hz]))
    if left([*fitted_hz, rough]) > (1 - _SHARE) * left(fitted_hz):
        return None
    span = (rough - cell / _STEPS, rough + cell / _STEPS)
    return float(minimize_scalar(lambda hz: left([*fitted_hz, hz]), bounds=span, method="bounded").x)
