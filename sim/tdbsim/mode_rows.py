"""The rotor's modes in rows of one array: drift, impulses and gyroscopic coupling.

Rows have a fixed length, so the compiler knows that they do not overlap and vectorises over eight modes.
"""

from __future__ import annotations

import numpy as np

from tdbsim import state_layout
from tdbsim.cache import in_order, inlined

LANES = 8  # the number of modes is padded with zeros to a multiple of it
ROW = 17 * LANES  # an odd multiple: rows a power of two apart would evict each other from the processor's cache
# displacements and velocities: the state
X, Y, RATE_X, RATE_Y = range(0, 4 * ROW, ROW)
# of a kick: pending halves of impulses, impulses of effects, gyroscopic coupling of the planes; model constants: shapes at the
# ends, unbalance, weight
(
    PUSH_X, PUSH_Y, MORE_X, MORE_Y, TURN_X, TURN_Y, SHAPE_0, SHAPE_1, COSINE, SINE, WEIGHT, MODES_STOP,
) = range(4 * ROW, 16 * ROW, ROW)  # fmt: skip
SAME, ALONG, BACK, STAY, SWING_STOP = range(0, 5 * ROW, ROW)  # of a drift's table


@inlined
def mode_rows(m, y):  # type: ignore[no-untyped-def]
    """Return the rows filled from model and state."""
    modal = np.zeros(MODES_STOP)
    n = len(m.square)
    rates = state_layout.positions(n)
    for k in range(n):
        modal[X + k], modal[Y + k] = y[k], y[n + k]
        modal[RATE_X + k], modal[RATE_Y + k] = y[rates + k], y[rates + n + k]
        modal[SHAPE_0 + k], modal[SHAPE_1 + k] = m.at_end[0, k], m.at_end[1, k]
        modal[COSINE + k], modal[SINE + k] = m.unbalance[0, k], m.unbalance[1, k]
        modal[WEIGHT + k] = m.weight[k]
    return modal


@inlined
def copy_modes(modal, lanes, copy):  # type: ignore[no-untyped-def]
    """Copy the state into the same rows of another array."""
    for k in range(lanes):
        copy[X + k], copy[Y + k] = modal[X + k], modal[Y + k]
        copy[RATE_X + k], copy[RATE_Y + k] = modal[RATE_X + k], modal[RATE_Y + k]


@inlined
def store_modes(modal, n, out, row):  # type: ignore[no-untyped-def]
    """Write the state into a row of `out`, in the order of `tdbsim.state_layout`."""
    rates = state_layout.positions(n)
    for k in range(n):
        out[row, k], out[row, n + k] = modal[X + k], modal[Y + k]
        out[row, rates + k], out[row, rates + n + k] = modal[RATE_X + k], modal[RATE_Y + k]


@inlined
def gyro_rows(gyro, lanes):  # type: ignore[no-untyped-def]
    """Return the gyroscopic matrix as (lanes / 8, 8 rows), eight columns together."""
    rows = np.zeros((lanes // LANES, LANES * ROW))
    for j in range(len(gyro)):
        for k in range(len(gyro)):
            rows[j // LANES, j % LANES * ROW + k] = gyro[k, j]
    return rows


@inlined
def drift(modal, lanes, table, size, s):  # type: ignore[no-untyped-def]
    """Advance displacements and velocities, pending impulses included; return x, y and their rates at both ends."""
    x0, y0, u0, v0, x1, y1, u1, v1 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(lanes):
        same, along = table[size, s, SAME + k], table[size, s, ALONG + k]
        back, stay = table[size, s, BACK + k], table[size, s, STAY + k]
        x, y = modal[X + k], modal[Y + k]
        u, v = modal[RATE_X + k] + modal[PUSH_X + k], modal[RATE_Y + k] + modal[PUSH_Y + k]
        x, u = same * x + along * u, back * x + stay * u
        y, v = same * y + along * v, back * y + stay * v
        modal[X + k], modal[RATE_X + k] = x, u
        modal[Y + k], modal[RATE_Y + k] = y, v
        modal[PUSH_X + k], modal[PUSH_Y + k] = 0.0, 0.0
        first, second = modal[SHAPE_0 + k], modal[SHAPE_1 + k]
        x0 += first * x
        y0 += first * y
        u0 += first * u
        v0 += first * v
        x1 += second * x
        y1 += second * y
        u1 += second * u
        v1 += second * v
    return x0, y0, u0, v0, x1, y1, u1, v1


@inlined
def push(modal, lanes, along, across, jx0, jy0, jx1, jy1, fall, turn, struck):  # type: ignore[no-untyped-def]
    """Apply half of the impulses to the velocities and keep the other half pending; return the work of all but the end impulses.

    `along`, `across` : impulse of the unbalance, along its cosine part and across; `jx0` ... `jy1` : impulses at the ends;
    `fall` : time for which weight acts; `turn`, `struck` : factors of the gyroscopic coupling on velocity and displacement.
    """
    supplied = 0.0
    for k in range(lanes):
        cosine, sine = modal[COSINE + k], modal[SINE + k]
        push_x = cosine * along - sine * across + modal[MORE_X + k]
        push_y = cosine * across + sine * along + modal[MORE_Y + k]
        first, second = modal[SHAPE_0 + k], modal[SHAPE_1 + k]
        struck_x = first * jx0 + second * jx1
        struck_y = first * jy0 + second * jy1 + fall * modal[WEIGHT + k]
        u, v = modal[RATE_X + k], modal[RATE_Y + k]
        supplied += push_x * (u + 0.5 * (struck_x + push_x)) + push_y * (v + 0.5 * (struck_y + push_y))
        push_x, push_y = 0.5 * (push_x + struck_x), 0.5 * (push_y + struck_y)
        modal[PUSH_X + k], modal[PUSH_Y + k] = push_x, push_y
        u += push_x
        v += push_y
        modal[RATE_X + k], modal[RATE_Y + k] = u, v
        modal[TURN_X + k], modal[TURN_Y + k] = turn * u + struck * modal[X + k], -turn * v - struck * modal[Y + k]
    return supplied


@in_order
def turn_plane(modal, lanes, gyro, source, place, rate, answer, turn, struck):  # type: ignore[no-untyped-def]
    """Apply the gyroscopic coupling in row `source`, from the other plane, to the velocities in row `rate`.

    The resulting coupling back to the other plane is stored in row `answer`.
    """
    for j in range(lanes // LANES):
        i = source + LANES * j
        a0, a1, a2, a3 = modal[i], modal[i + 1], modal[i + 2], modal[i + 3]
        a4, a5, a6, a7 = modal[i + 4], modal[i + 5], modal[i + 6], modal[i + 7]
        for k in range(lanes):
            first = (gyro[j, k] * a0 + gyro[j, ROW + k] * a1) + (gyro[j, 2 * ROW + k] * a2 + gyro[j, 3 * ROW + k] * a3)
            second = (gyro[j, 4 * ROW + k] * a4 + gyro[j, 5 * ROW + k] * a5) + (
                gyro[j, 6 * ROW + k] * a6 + gyro[j, 7 * ROW + k] * a7
            )
            turned = modal[rate + k] + (first + second)
            modal[rate + k] = turned
            modal[answer + k] = turn * turned + struck * modal[place + k]
