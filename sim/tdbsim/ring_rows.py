"""Inner rings, outer rings and foundations of both ends in rows of one array, with their springs and dampers.

A row holds x and y of the first end, x and y of the second, and zeros up to a vector of eight.
"""

from __future__ import annotations

import math

import numpy as np

from tdbsim import state_layout
from tdbsim.cache import called, inlined
from tdbsim.columns import (
    BALL_DAMPING,
    FOUNDATION_DAMPING,
    FOUNDATION_MOBILITY,
    FOUNDATION_STIFFNESS,
    GRAVITY,
    RING_MASS,
    SUPPORT_DAMPING,
    SUPPORT_MASS,
)
from tdbsim.mode_rows import LANES
from tdbsim.state_layout import ROLLED, YIELDED

# positions, velocities, work done on the dampers: the state
(
    RING, OUTER, BASE, RING_RATE, OUTER_RATE, BASE_RATE, ROLLING, YIELDING, RING_STATE,
) = range(0, 9 * LANES, LANES)  # fmt: skip
# of a kick: forces and impulses, velocities of inner relative to outer ring and of that relative to foundation; constants
(
    BALL_FORCE, SPRING_FORCE, IMPULSE, ROLL, YIELD, RING_LIGHT, OUTER_LIGHT, BASE_LIGHT, BASE_STIFFNESS, ROLL_DAMPING,
    YIELD_DAMPING, BASE_DAMPING, FALL, RING_STOP,
) = range(RING_STATE, RING_STATE + 14 * LANES, LANES)  # fmt: skip
TAKEN_RING, TAKEN_OUTER, TAKEN_SUPPORT, TAKEN_FROM_BASE, TAKEN_BASE, DAMPER_STOP = range(0, 6 * LANES, LANES)


@inlined
def ring_rows(m, y):  # type: ignore[no-untyped-def]
    """Return the rows filled from model and state."""
    n = len(m.square)
    rates, ledger = state_layout.positions(n), state_layout.work(n)
    rows = np.zeros(RING_STOP)
    for end in range(2):
        row = m.end[end]
        rows[ROLLING + 2 * end], rows[YIELDING + 2 * end] = y[ledger + ROLLED + end], y[ledger + YIELDED + end]
        for axis in range(2):
            lane = 2 * end + axis
            for part in range(3):
                at = state_layout.bodies(n, end) + 2 * part + axis
                rows[RING + part * LANES + lane] = y[at]
                rows[RING_RATE + part * LANES + lane] = y[rates + at]
            rows[RING_LIGHT + lane], rows[OUTER_LIGHT + lane] = 1.0 / row[RING_MASS], 1.0 / row[SUPPORT_MASS]
            rows[BASE_LIGHT + lane], rows[BASE_STIFFNESS + lane] = row[FOUNDATION_MOBILITY], row[FOUNDATION_STIFFNESS]
            rows[ROLL_DAMPING + lane], rows[YIELD_DAMPING + lane] = row[BALL_DAMPING], row[SUPPORT_DAMPING]
            rows[BASE_DAMPING + lane] = row[FOUNDATION_DAMPING]
            rows[FALL + lane] = m.spin[GRAVITY] if axis == 1 else 0.0
    return rows


@inlined
def copy_rings(rows, copy):  # type: ignore[no-untyped-def]
    """Copy the state into another array."""
    for k in range(RING_STATE):
        copy[k] = rows[k]


@inlined
def store_rings(rows, n, out, row):  # type: ignore[no-untyped-def]
    """Write the state into a row of `out`, in the order of `tdbsim.state_layout`.

    The work of both axes is summed into one of them, so that a call that continues from here gives identical results.
    """
    rates, ledger = state_layout.positions(n), state_layout.work(n)
    for end in range(2):
        for axis in range(2):
            lane = 2 * end + axis
            for part in range(3):
                at = state_layout.bodies(n, end) + 2 * part + axis
                out[row, at] = rows[RING + part * LANES + lane]
                out[row, rates + at] = rows[RING_RATE + part * LANES + lane]
        lane = 2 * end
        rows[ROLLING + lane] += rows[ROLLING + lane + 1]
        rows[YIELDING + lane] += rows[YIELDING + lane + 1]
        rows[ROLLING + lane + 1], rows[YIELDING + lane + 1] = 0.0, 0.0
        out[row, ledger + ROLLED + end] = rows[ROLLING + lane]
        out[row, ledger + YIELDED + end] = rows[YIELDING + lane]


@called
def damper_table(m, h, kicks, table):  # type: ignore[no-untyped-def]
    """Fill the table (kicks, rows): relative velocity removed by the dampers in half of each kick."""
    for s in range(len(kicks)):
        t = 0.5 * kicks[s] * h
        for lane in range(4):
            row = m.end[lane // 2]
            ring, outer, base = 1.0 / row[RING_MASS], 1.0 / row[SUPPORT_MASS], row[FOUNDATION_MOBILITY]
            taken = -math.expm1(-row[BALL_DAMPING] * (ring + outer) * t)
            table[s, TAKEN_RING + lane] = taken * ring / (ring + outer)
            table[s, TAKEN_OUTER + lane] = taken * outer / (ring + outer)
            taken = -math.expm1(-row[SUPPORT_DAMPING] * (outer + base) * t)
            table[s, TAKEN_SUPPORT + lane] = taken * outer / (outer + base)
            table[s, TAKEN_FROM_BASE + lane] = taken * base / (outer + base)
            table[s, TAKEN_BASE + lane] = -math.expm1(-row[FOUNDATION_DAMPING] * base * t)


@inlined
def damp(ring, outer, base, a, b, c, d, e):  # type: ignore[no-untyped-def]
    """Return velocities of inner ring, outer ring and foundation along an axis after half a kick of the dampers."""
    slip = ring - outer
    ring -= a * slip
    outer += b * slip
    slip = outer - base
    outer -= c * slip
    base += d * slip
    return ring, outer, base - e * base


@inlined
def move_rings(rows, axes, tau):  # type: ignore[no-untyped-def]
    """Advance the positions."""
    for a in range(axes):
        rows[RING + a] += tau * rows[RING_RATE + a]
        rows[OUTER + a] += tau * rows[OUTER_RATE + a]
        rows[BASE + a] += tau * rows[BASE_RATE + a]


@inlined
def damp_rings(rows, axes, table, size, s):  # type: ignore[no-untyped-def]
    """Apply the dampers for the kick's first half, before forces and impulses."""
    for a in range(axes):
        ring, outer, base = damp(
            rows[RING_RATE + a], rows[OUTER_RATE + a], rows[BASE_RATE + a],
            table[size, s, TAKEN_RING + a], table[size, s, TAKEN_OUTER + a], table[size, s, TAKEN_SUPPORT + a],
            table[size, s, TAKEN_FROM_BASE + a], table[size, s, TAKEN_BASE + a],
        )  # fmt: skip
        rows[RING_RATE + a], rows[OUTER_RATE + a], rows[BASE_RATE + a] = ring, outer, base
        rows[ROLL + a], rows[YIELD + a] = ring - outer, outer - base
        rows[IMPULSE + a] = 0.0


@inlined
def push_rings(rows, axes, table, size, s, tau):  # type: ignore[no-untyped-def]
    """Apply forces and impulses for the whole kick, and the dampers for its second half; book the dampers' work."""
    for a in range(axes):
        ball, spring = rows[BALL_FORCE + a], rows[SPRING_FORCE + a]
        ring = rows[RING_RATE + a] + (tau * ball - rows[IMPULSE + a]) * rows[RING_LIGHT + a] - tau * rows[FALL + a]
        outer = rows[OUTER_RATE + a] + tau * (spring - ball) * rows[OUTER_LIGHT + a]
        base = rows[BASE_RATE + a] - tau * rows[BASE_LIGHT + a] * (spring + rows[BASE_STIFFNESS + a] * rows[BASE + a])
        roll, sway = 0.5 * (rows[ROLL + a] + ring - outer), 0.5 * (rows[YIELD + a] + outer - base)
        rows[ROLLING + a] += tau * rows[ROLL_DAMPING + a] * roll * roll
        rows[YIELDING + a] += tau * (rows[YIELD_DAMPING + a] * sway * sway + rows[BASE_DAMPING + a] * base * base)
        ring, outer, base = damp(
            ring, outer, base,
            table[size, s, TAKEN_RING + a], table[size, s, TAKEN_OUTER + a], table[size, s, TAKEN_SUPPORT + a],
            table[size, s, TAKEN_FROM_BASE + a], table[size, s, TAKEN_BASE + a],
        )  # fmt: skip
        rows[RING_RATE + a], rows[OUTER_RATE + a], rows[BASE_RATE + a] = ring, outer, base
