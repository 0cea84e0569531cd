"""Higher orders of the shaft's surface and harmonics of the hum that the probes see before the release: they go on in the fall.

Left out, their velocity is taken for the shaft's, and shifts the release by that over gravity: 1 um of a three-lobed surface at
97 Hz by up to 0.19 ms.
"""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.left_by_lines import left_by

_ORDERS, _HARMONICS = range(3, 11), range(2, 7)  # of the speed, and of the mains
_TURNS = 3.0  # of the shaft in the levitated stretch at least: in fewer its orders are not told from drift
_APART = 1.0  # cells of the spectrum from lines that are fitted already
# improvement of the misfit (chi-square): the greatest of a dozen, in a floor that is not quite white
_STANDS_OUT = 60.0


def surface_orders(
    t: np.ndarray, data: np.ndarray, turning: float | None, mains: float | None, fastest: float
) -> list[float]:
    """Return the frequencies of higher orders and harmonics that stand out of the levitated shaft's noise, Hz.

    Parameters
    ----------
    t : (k,) array
        Times of the levitated stretch, s.
    data : (n, k) array
        Displacements, m.
    turning : float or None
        Of the shaft, Hz; without it no order is known, and a line may as well be the shaft's.
    mains : float or None
        Of the hum that is fitted, Hz.
    fastest : float
        Above it a line shows in no record, Hz.
    """
    if not turning or len(t) < 16 or (t[-1] - t[0]) * turning < _TURNS:
        return []
    apart = _APART / float(t[-1] - t[0])
    found: list[float] = []
    fitted = [turning, 2 * turning, *([mains] if mains else [])]
    since = t - t[0]
    left = left_by(since, data, fitted)
    for hz in [k * turning for k in _ORDERS] + [k * mains for k in _HARMONICS if mains]:
        if hz > fastest or any(abs(hz - other) <= apart for other in (*fitted, *found)):
            continue
        rest = left_by(since, data, [*fitted, *found, hz])
        if rest > 0 and data.size * np.log(left / rest) > _STANDS_OUT:
            found.append(hz)
            left = rest
    return found
