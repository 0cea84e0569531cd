"""The rotor's modes in eight drops side by side: drift, impulses and gyroscopic coupling.

Mode shapes, frequencies and gyroscopic matrix are the rotor's, so the same in all lanes; states, unbalances and impulses differ.
"""

from __future__ import annotations

from tdbsim.cache import in_order, inlined
from tdbsim.vectors import LANES, load, spread, store

# of a mode in the state, counted from the first mode
X, Y, RATE_X, RATE_Y, MODE_STATE = range(0, 5 * LANES, LANES)
# of a mode in a kick, as in `tdbsim.mode_rows`
PUSH_X, PUSH_Y, MORE_X, MORE_Y, TURN_X, TURN_Y, COSINE, SINE, MODE_STOP = range(0, 9 * LANES, LANES)
SAME, ALONG, BACK, STAY, SWING_STOP = range(0, 5 * LANES, LANES)  # of a mode in a drift's table
BLOCK = 4  # modes whose gyroscopic terms are summed together; the number of modes is padded to a multiple of it


@inlined
def drift(state, modes, modal, n, at_end, table):  # type: ignore[no-untyped-def]
    """Advance all modes, pending halves of impulses included; return x, y and their rates at both ends."""
    x0, y0, u0, v0 = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    x1, y1, u1, v1 = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    for k in range(n):
        i, j, t = modes + k * MODE_STATE, k * MODE_STOP, k * SWING_STOP
        same, along = load(table, t + SAME), load(table, t + ALONG)
        back, stay = load(table, t + BACK), load(table, t + STAY)
        x, y = load(state, i + X), load(state, i + Y)
        u = load(state, i + RATE_X) + load(modal, j + PUSH_X)
        v = load(state, i + RATE_Y) + load(modal, j + PUSH_Y)
        x, u = same * x + along * u, back * x + stay * u
        y, v = same * y + along * v, back * y + stay * v
        store(state, i + X, x)
        store(state, i + Y, y)
        store(state, i + RATE_X, u)
        store(state, i + RATE_Y, v)
        store(modal, j + PUSH_X, 0.0)
        store(modal, j + PUSH_Y, 0.0)
        first, second = at_end[k], at_end[n + k]
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
def lost(state, modes, n, damping):  # type: ignore[no-untyped-def]
    """Return the power dissipated by modal damping."""
    total = spread(0.0)
    for k in range(n):
        i = modes + k * MODE_STATE
        u, v = load(state, i + RATE_X), load(state, i + RATE_Y)
        total += damping[k] * (u * u + v * v)
    return total


@inlined
def push(state, modes, modal, n, at_end, weight, along, across, jx0, jy0, jx1, jy1, fall, turn, struck):  # type: ignore[no-untyped-def]
    """Apply half of the impulses to the velocities and keep the other half pending, as `tdbsim.mode_rows.push`."""
    supplied = spread(0.0)
    for k in range(n):
        i, j = modes + k * MODE_STATE, k * MODE_STOP
        cosine, sine = load(modal, j + COSINE), load(modal, j + SINE)
        push_x = cosine * along - sine * across + load(modal, j + MORE_X)
        push_y = cosine * across + sine * along + load(modal, j + MORE_Y)
        first, second = at_end[k], at_end[n + k]
        struck_x = first * jx0 + second * jx1
        struck_y = first * jy0 + second * jy1 + fall * weight[k]
        u, v = load(state, i + RATE_X), load(state, i + RATE_Y)
        supplied += push_x * (u + 0.5 * (struck_x + push_x)) + push_y * (v + 0.5 * (struck_y + push_y))
        push_x, push_y = 0.5 * (push_x + struck_x), 0.5 * (push_y + struck_y)
        store(modal, j + PUSH_X, push_x)
        store(modal, j + PUSH_Y, push_y)
        u += push_x
        v += push_y
        store(state, i + RATE_X, u)
        store(state, i + RATE_Y, v)
        store(modal, j + TURN_X, turn * u + struck * load(state, i + X))
        store(modal, j + TURN_Y, -turn * v - struck * load(state, i + Y))
    return supplied


@in_order
def turn_plane(state, modes, modal, n, gyro, source, place, rate, answer, turn, struck):  # type: ignore[no-untyped-def]
    """Apply the gyroscopic coupling of the other plane to the velocities of one, as `tdbsim.mode_rows.turn_plane`.

    `gyro` : the matrix in blocks of four rows, interleaved by column.
    """
    for first in range(0, n, BLOCK):
        a, b, c, d = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
        for k in range(n):
            other, i = load(modal, k * MODE_STOP + source), first * n + k * BLOCK
            a += gyro[i] * other
            b += gyro[i + 1] * other
            c += gyro[i + 2] * other
            d += gyro[i + 3] * other
        turned(state, modes, modal, first, place, rate, answer, turn, struck, a)
        turned(state, modes, modal, first + 1, place, rate, answer, turn, struck, b)
        turned(state, modes, modal, first + 2, place, rate, answer, turn, struck, c)
        turned(state, modes, modal, first + 3, place, rate, answer, turn, struck, d)


@inlined
def turned(state, modes, modal, k, place, rate, answer, turn, struck, change):  # type: ignore[no-untyped-def]
    """Change a mode's velocity, and store its contribution to the other plane."""
    i, j = modes + k * MODE_STATE, k * MODE_STOP
    changed = load(state, i + rate) + change
    store(state, i + rate, changed)
    store(modal, j + answer, turn * changed + struck * load(state, i + place))
