"""Search for the sample at which the shaft leaves its levitated orbit, and the one until which it surely falls freely."""

from __future__ import annotations

import numpy as np
from tdbsim.errors import InputError

# surely free of contact: fraction of the way from levitation to the first turning point, and fraction of the radial gap, which
# limits it if the bearing yields so much that the turning point lies far beyond the gap
_FALL_SHARE, _FREE_SHARE = 0.6, 0.85
_HEAD_S = 0.02  # at the start of the record, for the levitated position
_START_S = 1e-3  # the same, if the shaft may fall soon; also the least duration of a departure: a spike is no fall
_LEAST_HEAD_S = 5e-3
# of the radial gap: a shaft that has moved so far from its first position, wherever on its orbit that was, no longer levitates
# (zone A of ISO 14839-2 ends at 0.3 from the centre)
_FALLEN = 0.6
_DROPPED = 0.5  # of the radial gap, beyond the orbit: a shaft that moves so far was dropped
_LEFT = 0.2  # of the radial gap, beyond the orbit: the shaft has left its orbit


def surely_levitated(z: np.ndarray, rate: float, gaps: np.ndarray, gravity: float) -> int:
    """Return the number of initial samples, up to 20 ms, that surely precede the fall, judged by the distance moved.

    Parameters
    ----------
    z : (2 n, k) array
        Positions of n ends, x and y in turn, m.
    rate : float
        Hz.
    gaps : (2 n,) array
        Radial gap of each row, m.
    gravity : float
        m/s^2.
    """
    most, lasting, reach = int(_HEAD_S * rate), max(int(_START_S * rate), 1), _FALLEN * gaps
    fall = np.sqrt(2 * reach.max() / max(gravity, 1.0))
    falling = int(1.2 * fall * rate)  # with a margin
    if not np.isfinite(z[:, :lasting]).any(axis=1).all():
        return 0
    start = np.nanmedian(z[:, :lasting], axis=1)
    away = np.abs(z[:, : most + falling + lasting] - start[:, None]) > reach[:, None]
    if away.shape[1] < lasting:
        return 0
    fallen = np.lib.stride_tricks.sliding_window_view(away, lasting, axis=1).all(axis=2).any(axis=0)
    return max(int(np.argmax(fallen)) - falling, 0) if fallen.any() else most


def falls_between(z: np.ndarray, rate: float, gaps: np.ndarray, levitated: int) -> tuple[int, int] | None:
    """Return the index of the sample at which the shaft leaves its orbit, and of the one that ends the surely free fall.

    The threshold is a multiple of the orbit, or for a wide orbit less: the orbit plus a fraction of the gap.

    Parameters
    ----------
    z, rate, gaps
        As in `surely_levitated`.
    levitated : int
        Number of initial samples that show the orbit.

    Returns
    -------
    tuple or None
        None if the record starts after the release, or less than 5 ms before it.

    Raises
    ------
    InputError
        If the record is too short to hold a drop, or the rotor never leaves its orbit.
    """
    shortest = max(int(_LEAST_HEAD_S * rate), 8)
    if z.shape[1] < 3 * shortest:
        raise InputError(
            f"the displacement record has {z.shape[1]} samples in {z.shape[1] / rate * 1e3:.3g} ms, too short for a drop;"
            " check the sampling interval and the unit of time"
        )
    if levitated < shortest:
        return None
    lead = levitated
    head = z[:, :lead]
    middle = np.nanmedian(head, axis=1)
    away = np.abs(z - middle[:, None])
    orbit = np.nanmax(away[:, :lead], axis=1)
    reach = np.nanmax(away, axis=1)
    dropped = reach > np.maximum(np.minimum(8 * orbit, orbit + _DROPPED * gaps), 20e-6)
    if not np.any(dropped):
        if np.any(orbit > 20e-6):
            return None  # motion from the first sample on: the record starts after the release
        raise InputError(
            f"the rotor never leaves its levitated position by more than {np.nanmax(reach) * 1e6:.1f} um;"
            " this record contains no drop"
        )
    free = np.inf
    ends: tuple[list[int], list[int]] = [], []  # of the fall in each row that dropped: x, y
    for row in range(z.shape[0]):
        if not dropped[row]:
            continue
        threshold = max(min(3 * orbit[row], orbit[row] + _LEFT * gaps[row]), 3e-6)
        outside = away[row] > threshold
        run = max(int(0.002 * rate), 4)
        sustained = np.convolve(outside, np.ones(run), "valid") >= run
        if not sustained.any():
            continue
        left = int(np.argmax(sustained))
        free = min(free, left)
        tail = away[row, left : left + max(int(0.05 * rate), 8)]
        farthest = np.fmax.accumulate(tail)
        back = np.flatnonzero(tail < farthest - orbit[row] - 2e-6)
        bottom = farthest[back[0]] if back.size else farthest[-1]
        ends[row % 2].append(left + int(np.argmax(tail > min(_FALL_SHARE * bottom, _FREE_SHARE * gaps[row]))))
    if not np.isfinite(free) or free < lead:
        return None
    stop = min(ends[1] or ends[0])  # nothing falls sideways: the rows with a vertical fall, if any, determine it alone
    return int(free), max(stop, int(free) + 4)
