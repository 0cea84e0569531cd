"""The speed that the levitated orbit itself turns with, and whether hum is told from it."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.left_by_lines import left_by

_TELLS = 12.0  # improvement of the misfit (chi-square) from which on the orbit's own speed is taken
_TELLS_ALONE = 60.0  # the same where no speed is stated: the best of hundreds
_FASTEST_HZ = 500.0
_NEAR = 0.02  # of a stated speed: so far the orbit's own is sought
_APART = 0.5  # periods over the stretch, by which mains frequency must differ from every order


def turning_speed(t: np.ndarray, data: np.ndarray, speed_hz: float | None, mains_hz: float | None) -> float | None:
    """Return the speed that the levitated orbit itself turns with, where it tells; else the stated one.

    A stated speed that is a per cent off would bend the orbit's phase at the release, as a soft start does, and wash out its
    amplitude over a long stretch.

    Parameters
    ----------
    t : (k,) array
        s.
    data : (n, k) array
        Displacements, m.
    speed_hz : float or None
        The stated speed; None where nothing is known.
    mains_hz : float or None
        Of a hum that goes on beside it; None for none.

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
    better = data.size * np.log(without / found.fun) if found.fun > 0 else 0.0  # as a chi-square
    return float(found.x) if better > (_TELLS if speed_hz else _TELLS_ALONE) else speed_hz


def told_from_orders(periods: float, turns: float, highest: int) -> bool:
    """True where a hum of so many periods over a stretch is told from all orders, up to the highest, of so many turns.

    Where it is not, the two are one line: fitted together they would share its amplitude by halves.
    """
    return min(abs(periods - k * turns) for k in range(1, highest + 1)) > _APART
