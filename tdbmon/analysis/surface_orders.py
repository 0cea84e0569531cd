"""Detection of higher run-out orders and mains hum harmonics in the levitated stretch, which continue during the fall.

If neglected, their velocity is attributed to the shaft and shifts the release by velocity over gravity: 1 um of three-lobed
run-out at 97 Hz by up to 0.19 ms.
"""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.left_by_lines import left_by

_ORDERS, _HARMONICS = range(3, 11), range(2, 7)  # of the speed, and of the mains
_TURNS = 3.0  # least revolutions in the levitated stretch: with fewer, orders cannot be separated from drift
_APART = 1.0  # least distance from lines already fitted, in bins of the spectrum
# least decrease of chi-square, as the largest of a dozen candidates is tested in noise that is not quite white
_STANDS_OUT = 60.0


def surface_orders(
    t: np.ndarray, data: np.ndarray, turning: float | None, mains: float | None, fastest: float
) -> list[float]:
    """Return the frequencies of higher orders and hum harmonics that are significant in the levitated stretch, Hz.

    Parameters
    ----------
    t : (k,) array
        Times of the levitated stretch, s.
    data : (n, k) array
        Displacements, m.
    turning : float or None
        Rotor speed, Hz; None if unknown, and nothing is returned since a line could be the shaft's own 1X.
    mains : float or None
        Mains frequency, Hz, if hum is fitted.
    fastest : float
        Highest frequency considered, Hz.
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
