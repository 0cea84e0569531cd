"""States and machine constants of eight drops side by side: quantity by quantity, eight lanes of each."""

from __future__ import annotations

import math

import numpy as np

from tdbsim import hooks, state_layout
from tdbsim.cache import called, inlined
from tdbsim.columns import (
    BALL_COUNT,
    CAGE_ANGLE,
    CAGE_RATIO,
    END_COLUMNS,
    GAP,
    HALF_CLEARANCE,
    INERTIA,
    JOURNAL_RADIUS,
    RING_ANGLE,
    RING_INERTIA,
    RING_MASS,
    ROTOR_ROW,
    SUPPORT_MASS,
    WAVES_REACH,
)
from tdbsim.drop_model import Arrays
from tdbsim.lane_modes import BLOCK, COSINE, MODE_STATE, MODE_STOP, RATE_X, RATE_Y, SINE, X, Y
from tdbsim.state_layout import LEDGER
from tdbsim.vectors import LANES, beyond, load, masked, store, where

# the state: positions and velocities of the rings along x and y of the first and the second end, angles, work, then the modes
_AXES, _BODIES = 4, 3
(RING, OUTER, BASE, RING_RATE, OUTER_RATE, BASE_RATE, _TURNING) = range(0, 7 * _AXES * LANES, _AXES * LANES)
(ANGLE, SPIN, COSINES, SINES, WORK) = range(_TURNING, _TURNING + 5 * _BODIES * LANES, _BODIES * LANES)
MODES = WORK + len(LEDGER) * LANES
# constants of an end: the columns of `Arrays.end`, and derived ones
(
    RING_LIGHT, RING_TURN, OUTER_LIGHT, TURNING, SLIDE, SLIDE_LIGHT, ARM, FREE, END_STOP,
) = range(END_COLUMNS * LANES, (END_COLUMNS + 9) * LANES, LANES)  # fmt: skip
EFFECT_WIDTH = hooks.row_length()
BALL_COSINE, BALL_SINE, BALL_PRESS, BALL_STOP = range(0, 4 * LANES, LANES)


@inlined
def of_lane(m, a):  # type: ignore[no-untyped-def]
    """Return the arrays of one lane."""
    return Arrays(
        m.square, m.damping, m.gyro, m.at_end, m.weight, m.unbalance[a], m.bow[a], m.circulatory[a], m.at_magnet[a],
        m.magnet[a], m.spin[a], m.end[a], m.ball_cosine[a], m.ball_sine[a], m.ball_oversize[a], m.effect[a],
    )  # fmt: skip


@inlined
def effect_of(effects, a, end):  # type: ignore[no-untyped-def]
    """Return the coefficients of the effects' hooks of a lane, for an end or the rotor."""
    return beyond(effects, (a * (ROTOR_ROW + 1) + end) * EFFECT_WIDTH)


@inlined
def room_for(count):  # type: ignore[no-untyped-def]
    """Return space for `count` zero vectors, each aligned to a cache line."""
    space = np.zeros((count + 1) * LANES)
    return space[-(space.ctypes.data // 8) % LANES :]


@called
def read_state(y, n, state):  # type: ignore[no-untyped-def]
    """Fill the state from vectors (lanes, size) in the order of `tdbsim.state_layout`, except cosines and sines."""
    rates = state_layout.positions(n)
    for a in range(LANES):
        for end in range(2):
            for axis in range(2):
                for part in range(3):
                    place = (part * _AXES + 2 * end + axis) * LANES + a
                    at = state_layout.bodies(n, end) + 2 * part + axis
                    state[RING + place], state[RING_RATE + place] = y[a, at], y[a, rates + at]
        for k in range(3):
            state[ANGLE + k * LANES + a] = y[a, state_layout.shaft_angle(n) + k]
            state[SPIN + k * LANES + a] = y[a, state_layout.omega(n) + k]
        for k in range(len(LEDGER)):
            state[WORK + k * LANES + a] = y[a, state_layout.work(n) + k]
        for k in range(n):
            i = MODES + k * MODE_STATE + a
            state[i + X], state[i + Y] = y[a, k], y[a, n + k]
            state[i + RATE_X], state[i + RATE_Y] = y[a, rates + k], y[a, rates + n + k]


@called
def write_state(state, n, a, out):  # type: ignore[no-untyped-def]
    """Write the state of a lane to `out`, in the order of `tdbsim.state_layout`."""
    rates = state_layout.positions(n)
    for k in range(n):
        i = MODES + k * MODE_STATE + a
        out[k], out[n + k] = state[i + X], state[i + Y]
        out[rates + k], out[rates + n + k] = state[i + RATE_X], state[i + RATE_Y]
    for end in range(2):
        for part in range(3):
            for axis in range(2):
                place = (part * _AXES + 2 * end + axis) * LANES + a
                at = state_layout.bodies(n, end) + 2 * part + axis
                out[at], out[rates + at] = state[RING + place], state[RING_RATE + place]
    for k in range(3):
        out[state_layout.shaft_angle(n) + k] = state[ANGLE + k * LANES + a]
        out[state_layout.omega(n) + k] = state[SPIN + k * LANES + a]
    for k in range(len(LEDGER)):
        out[state_layout.work(n) + k] = state[WORK + k * LANES + a]


@inlined
def take_back(state, kept, size, discarded):  # type: ignore[no-untyped-def]
    """Reset the discarded lanes, given as bits, to a state kept before; `size` : length of the state."""
    which = masked(discarded)
    for i in range(0, size, LANES):
        store(state, i, where(which, load(kept, i), load(state, i)))


@inlined
def keep(state, kept, size):  # type: ignore[no-untyped-def]
    """Copy the state."""
    for i in range(0, size, LANES):
        store(kept, i, load(state, i))


@called
def direct(state, ends, a):  # type: ignore[no-untyped-def]
    """Set a lane's cosines and sines from its angles."""
    state[COSINES + a], state[SINES + a] = math.cos(state[ANGLE + a]), math.sin(state[ANGLE + a])
    for end in range(2):
        at, p = (1 + end) * LANES + a, end * END_STOP + a
        turned = state[ANGLE + at] - ends[p + RING_ANGLE * LANES]
        cage = ends[p + CAGE_ANGLE * LANES] + ends[p + CAGE_RATIO * LANES] * turned
        state[COSINES + at], state[SINES + at] = math.cos(cage), math.sin(cage)


@called
def fill_ends(m, ends):  # type: ignore[no-untyped-def]
    """Write the constants of the ends, one end after the other."""
    for a in range(LANES):
        for end in range(2):
            at, row = end * END_STOP + a, m.end[a, end]
            for k in range(END_COLUMNS):
                ends[at + k * LANES] = row[k]
            arm, inertia = row[JOURNAL_RADIUS] + row[GAP], m.spin[a, INERTIA]
            own = 0.0
            for k in range(len(m.square)):
                own += m.at_end[end, k] * m.at_end[end, k]
            turning = row[JOURNAL_RADIUS] / inertia
            light = own + 1.0 / row[RING_MASS] + row[JOURNAL_RADIUS] * turning + arm**2 * (1.0 / row[RING_INERTIA])
            ends[at + RING_LIGHT], ends[at + RING_TURN] = 1.0 / row[RING_MASS], 1.0 / row[RING_INERTIA]
            ends[at + OUTER_LIGHT], ends[at + TURNING] = 1.0 / row[SUPPORT_MASS], turning
            ends[at + SLIDE], ends[at + SLIDE_LIGHT], ends[at + ARM] = 1.0 / light, light, arm
            most = -1.0
            for j in range(int(row[BALL_COUNT])):
                most = max(most, m.ball_oversize[a, end, j] - row[HALF_CLEARANCE])
            ends[at + FREE] = max(0.0, -most - row[WAVES_REACH])


@called
def fill_balls(m, end, balls):  # type: ignore[no-untyped-def]
    """Write the balls of an end, and return the greatest number; surplus balls of lanes with fewer never touch."""
    most = 0
    for a in range(LANES):
        count = int(m.end[a, end, BALL_COUNT])
        most = max(most, count)
        for j in range(m.ball_cosine.shape[2]):
            at = j * BALL_STOP + a
            balls[at + BALL_PRESS] = -1.0
            if j < count:
                balls[at + BALL_COSINE], balls[at + BALL_SINE] = m.ball_cosine[a, end, j], m.ball_sine[a, end, j]
                balls[at + BALL_PRESS] = m.ball_oversize[a, end, j] - m.end[a, end, HALF_CLEARANCE]
    return most


@called
def fill_unbalance(m, modal):  # type: ignore[no-untyped-def]
    """Write the lanes' unbalances among the quantities of a kick."""
    for a in range(LANES):
        for k in range(len(m.square)):
            modal[k * MODE_STOP + COSINE + a] = m.unbalance[a, 0, k]
            modal[k * MODE_STOP + SINE + a] = m.unbalance[a, 1, k]


@called
def fill_gyro(gyro, rows):  # type: ignore[no-untyped-def]
    """Write the gyroscopic matrix in the order that `tdbsim.lane_modes.turn_plane` reads."""
    n = len(gyro)
    for k in range(n):
        for j in range(n):
            rows[k // BLOCK * BLOCK * n + j * BLOCK + k % BLOCK] = gyro[k, j]


@called
def flagged(columns, column):  # type: ignore[no-untyped-def]
    """Return as bits which lanes have a positive value in a column of (lanes, columns)."""
    found = 0
    for a in range(LANES):
        if columns[a, column] > 0.0:
            found |= 1 << a
    return found
