"""Angles of shaft and inner rings in rows of one array, with incrementally updated cosines and sines.

Lanes are the shaft, the inner rings of both ends, and padding zeros; cosines and sines are those of shaft and cages.
"""

from __future__ import annotations

import math

import numpy as np

from tdbsim import state_layout
from tdbsim.ball_bearing import cage_angle
from tdbsim.cache import inlined
from tdbsim.columns import CAGE_RATIO
from tdbsim.mode_rows import LANES

ANGLE, SPIN, COSINES, SINES, RATIO, TURNING_STOP = range(0, 6 * LANES, LANES)
TURNING_STATE = RATIO
SMALL_TURN = 0.1  # rad; up to it a series is accurate


@inlined
def turning_rows(m, y):  # type: ignore[no-untyped-def]
    """Return the rows filled from model and state, except cosines and sines."""
    rows = np.zeros(TURNING_STOP)
    n = len(m.square)
    for k in range(3):
        rows[ANGLE + k], rows[SPIN + k] = y[state_layout.shaft_angle(n) + k], y[state_layout.omega(n) + k]
    rows[RATIO], rows[RATIO + 1], rows[RATIO + 2] = 1.0, m.end[0, CAGE_RATIO], m.end[1, CAGE_RATIO]
    return rows


@inlined
def set_directions(rows, columns):  # type: ignore[no-untyped-def]
    """Set cosines and sines from the angles."""
    rows[COSINES], rows[SINES] = math.cos(rows[ANGLE]), math.sin(rows[ANGLE])
    for end in range(2):
        cage = cage_angle(columns[end], rows[ANGLE + 1 + end])
        rows[COSINES + 1 + end], rows[SINES + 1 + end] = math.cos(cage), math.sin(cage)


@inlined
def copy_turning(rows, copy):  # type: ignore[no-untyped-def]
    """Copy the state into another array."""
    for k in range(TURNING_STATE):
        copy[k] = rows[k]


@inlined
def store_turning(rows, n, out, row):  # type: ignore[no-untyped-def]
    """Write angles and spins into a row of `out`, in the order of `tdbsim.state_layout`."""
    for k in range(3):
        out[row, state_layout.shaft_angle(n) + k] = rows[ANGLE + k]
        out[row, state_layout.omega(n) + k] = rows[SPIN + k]


@inlined
def turned_on(cosine, sine, turn):  # type: ignore[no-untyped-def]
    """Return cosine and sine of an angle after a small turn; numbers or vectors."""
    q = turn * turn
    c = 1.0 - q * (0.5 - q * (1 / 24 - q * (1 / 720 - q * (1 / 40320))))
    s = turn * (1.0 - q * (1 / 6 - q * (1 / 120 - q * (1 / 5040))))
    return cosine * c - sine * s, sine * c + cosine * s


@inlined
def turn_on(rows, axes, tau, columns):  # type: ignore[no-untyped-def]
    """Advance angles, cosines and sines by the spins, by a series for small turns, which are the usual ones."""
    fastest = max(abs(rows[SPIN]), abs(rows[SPIN + 1]), abs(rows[SPIN + 2]))
    for k in range(axes):
        rows[ANGLE + k] += tau * rows[SPIN + k]
        turn = tau * rows[RATIO + k] * rows[SPIN + k]
        rows[COSINES + k], rows[SINES + k] = turned_on(rows[COSINES + k], rows[SINES + k], turn)
    if fastest * abs(tau) > SMALL_TURN:
        set_directions(rows, columns)
