"""Rotor speed estimated from the levitated orbit, and the test whether mains hum can be separated from its orders."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.left_by_lines import left_by

_TELLS = 12.0  # least decrease of chi-square for the speed of the orbit to replace the stated one
_TELLS_ALONE = 60.0  # the same without a stated speed, for the best of hundreds of candidates
_FASTEST_HZ = 500.0
_NEAR = 0.02  # relative search range about a stated speed
_APART = 0.5  # least distance of the mains frequency from every order, in periods over the stretch


def turning_speed(t: np.ndarray, data: np.ndarray, speed_hz: float | None, mains_hz: float | None) -> float | None:
    """Return the rotor speed estimated from the levitated orbit if that is significant, else the stated speed.

    A stated speed that is one per cent off would shift the orbit's phase at the release, as a soft start does, and reduce its
    fitted amplitude over a long stretch.

    Parameters
    ----------
    t : (k,) array
        s.
    data : (n, k) array
        Displacements, m.
    speed_hz : float or None
        The stated speed, Hz; None if unknown.
    mains_hz : float or None
        Mains frequency of hum to be fitted as well, Hz; None for none.

    Returns
    -------
    float or None
        Hz.
    """
    from scipy.optimize import minimize_scalar

    if t.size < 20:
        return speed_hz

    def left(hz: float) -> float:
        return left_by(t, data, [line for line in (hz, 2 * hz, mains_hz) if line])

    span = float(t[-1] - t[0])
    if speed_hz:
        guess, reach, without = speed_hz, min(_NEAR * speed_hz, 0.5 / span), left(speed_hz)
    else:
        fastest = min(_FASTEST_HZ, 0.2 * t.size / span)
        grid = np.arange(2 / span, fastest, 0.3 / span)
        if not grid.size:
            return None
        guess, reach, without = float(min(grid, key=left)), 0.3 / span, left(0.0)
    found = minimize_scalar(left, bounds=(guess - reach, guess + reach), method="bounded")
    better = data.size * np.log(without / found.fun) if found.fun > 0 else 0.0  # decrease of chi-square
    return float(found.x) if better > (_TELLS if speed_hz else _TELLS_ALONE) else speed_hz


def told_from_orders(periods: float, turns: float, highest: int) -> bool:
    """Return True if hum can be separated from all orders up to the highest, given periods and revolutions over a stretch.

    If it cannot, the two form one line, whose amplitude a joint fit would split between them.
    """
    return min(abs(periods - k * turns) for k in range(1, highest + 1)) > _APART
