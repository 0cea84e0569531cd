"""Kernel of the exchange between a drop and the temperatures of a touchdown bearing at the end of an interval.

For the model and its signs see `tdbsim.heat_coupling`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdbsim import state_layout
from tdbsim.ball_bearing import ball_load, ball_press, cage_angle
from tdbsim.bearing_torque import race_shares, speed_torque
from tdbsim.cache import compiled, inlined
from tdbsim.columns import (
    BALL_COUNT,
    BALL_STIFFNESS,
    CONTACT_POWER,
    CONTACT_STIFFNESS,
    GAP,
    HALF_CLEARANCE,
    RING_DRAG,
)
from tdbsim.contact import elastic_force
from tdbsim.heat_network import GROWTHS, NODES, Network, warm
from tdbsim.rhs import touching
from tdbsim.state_layout import DRAGGED, EXTERNAL, HEAT, RUBBED

Array = NDArray[np.float64]

# columns of a bearing's course: torques that act from an instant on, N m; heats until then, J; temperatures, K; growths, m
LOAD_TORQUE, SPEED_TORQUE, SPIN_INNER, SPIN_OUTER, RUB_HEAT, INNER_HEAT, OUTER_HEAT, LOST = range(8)
RISE = LOST + 1
GROWN = RISE + len(NODES)
COURSE_COLUMNS = GROWN + len(GROWTHS)


class WarmBearings(NamedTuple):
    """Arrays of the e bearings with heat.

    ``end`` (e,) their ends; ``network`` of arrays with one row each; ``growth`` (e, 5, 8), m/K; ``closing`` (e, 2, 5) matrix from
    growths to changes of gap and half clearance; ``torque`` (e, 7) load torque per newton, f2, viscosity, pitch diameter, spin
    torques (`spin_per_press`), ball over pitch diameter; ``cold`` (e, 3) gap and half clearance without growth, m, and the
    machine's own drag, N m.
    """

    end: NDArray[np.intp]
    network: Network
    growth: Array
    closing: Array
    torque: Array
    cold: Array


@inlined
def _pressed_balls(m, end, y):  # type: ignore[no-untyped-def]
    """Return the resultant of the ball loads, N, the sum of squared compressions, m^2, and the elastic energy, J."""
    row = m.end[end]
    n = len(m.square)
    i, ring = state_layout.bodies(n, end), y[state_layout.ring_angle(n, end)]
    cage = cage_angle(row, ring)
    cosine, sine = math.cos(cage), math.sin(cage)
    ex, ey = y[i] - y[i + 2], y[i + 1] - y[i + 3]
    u, v = ex * cosine + ey * sine, ey * cosine - ex * sine
    along, across, squares, energy = 0.0, 0.0, 0.0, 0.0
    for j in range(int(row[BALL_COUNT])):
        press = ball_press(m, end, j, u, v, cage, ring)
        if press > 0.0:
            load = ball_load(press, row[BALL_STIFFNESS])
            along += load * m.ball_cosine[end, j]
            across += load * m.ball_sine[end, j]
            squares += press * press
            energy += 0.4 * load * press
    return math.sqrt(along * along + across * across), squares, energy


@inlined
def _elastic_energy(m, end, y):  # type: ignore[no-untyped-def]
    """Return the elastic energy in the contacts of rotor, ring and balls, J."""
    row = m.end[end]
    n = len(m.square)
    i, ring = state_layout.bodies(n, end), y[state_layout.ring_angle(n, end)]
    x, z = 0.0, 0.0
    for k in range(n):
        x += m.at_end[end, k] * y[k]
        z += m.at_end[end, k] * y[n + k]
    heat = y[state_layout.work(n) + HEAT + end]
    _, _, depth, _ = touching(m.end, m.effect, end, x - y[i], z - y[i + 1], ring, heat)
    _, _, balls = _pressed_balls(m, end, y)
    if depth <= 0.0:
        return balls
    return balls + elastic_force(depth, row[CONTACT_STIFFNESS], row[CONTACT_POWER]) * depth / (row[CONTACT_POWER] + 2.0)


@compiled
def exchange(m, bearings, before, states, step, y, courses):  # type: ignore[no-untyped-def]
    """Put the heat of an interval into the networks; compute the torques, gaps and clearances that act after it.

    Parameters
    ----------
    m : Arrays
        Gap, half clearance and drag of the ends with heat are changed.
    bearings : WarmBearings
    before : (size,) array
        State at the beginning of the interval.
    states : (k, size) array
        States at its samples, the last at its end.
    step : float
        Its length, s; 0 at the release.
    y : (size,) array
        State at the end of the interval; the work of growth is booked in it.
    courses : (e, columns) array
        At the beginning; at the end on return.

    Returns
    -------
    int
        An end whose gap has closed, or -1.
    """
    closed = -1
    drags = (m.end[0, RING_DRAG], m.end[1, RING_DRAG])
    for k in range(len(bearings.end)):
        end, course, cold = bearings.end[k], courses[k], bearings.cold[k]
        if step > 0.0:
            network = bearings.network
            network = Network(network.capacity[k], network.chain[k], network.to_air[k])
            _give_heat(m, end, network, bearings.torque[k, 6], before, states[len(states) - 1], step, drags, course)
        _find_torques(m, end, bearings.torque[k], states, course)
        row = m.end[end]
        stored = _elastic_energy(m, end, y)
        gap, half_clearance = cold[0], cold[1]
        for part in range(COURSE_COLUMNS - GROWN):
            grown = 0.0
            for node in range(GROWN - RISE):
                grown += bearings.growth[k, part, node] * course[RISE + node]
            course[GROWN + part] = grown
            gap += bearings.closing[k, 0, part] * grown
            half_clearance += bearings.closing[k, 1, part] * grown
        row[GAP], row[HALF_CLEARANCE] = gap, half_clearance
        row[RING_DRAG] = cold[2] + course[LOAD_TORQUE] + course[SPEED_TORQUE] + course[SPIN_INNER] + course[SPIN_OUTER]
        y[state_layout.work(len(m.square)) + EXTERNAL] += _elastic_energy(m, end, y) - stored
        if not gap > 0.0:
            closed = end
    return closed


@inlined
def _give_heat(m, end, network, across, before, after, step, drags, course):  # type: ignore[no-untyped-def]
    """Advance the temperatures in `course` by the work of friction and drag between two states."""
    n = len(m.square)
    ledger = state_layout.work(n)
    rubbed = after[ledger + RUBBED + end] - before[ledger + RUBBED + end]
    # the ledger holds the drag's work of both ends together: each has its torque times the angle of its ring
    own, other = state_layout.ring_angle(n, end), state_layout.ring_angle(n, 1 - end)
    mine = drags[end] * abs(after[own] - before[own])
    both = mine + drags[1 - end] * abs(after[other] - before[other])
    dragged = (after[ledger + DRAGGED] - before[ledger + DRAGGED]) * mine / both if both > 0.0 else 0.0
    share, other_share = race_shares(drags[end], course[SPIN_INNER], course[SPIN_OUTER], across)
    inner, outer = share * dragged, other_share * dragged
    shaft_speed = before[state_layout.omega(n)] / (2.0 * math.pi)
    ring_speed = before[state_layout.ring_speed(n, end)] / (2.0 * math.pi)
    rise = course[RISE:GROWN]
    course[LOST] += warm(network, rise, step, rubbed, inner, outer, shaft_speed, ring_speed)
    course[RUB_HEAT] += rubbed
    course[INNER_HEAT] += inner
    course[OUTER_HEAT] += outer


@inlined
def _find_torques(m, end, law, states, course):  # type: ignore[no-untyped-def]
    """Fill the torques of `course` from the mean load and speed of states; `law` : row of ``torque`` in `WarmBearings`."""
    n = len(m.square)
    turning = state_layout.ring_speed(n, end)
    loads, speeds, squares = 0.0, 0.0, 0.0
    for k in range(len(states)):
        load, pressed, _ = _pressed_balls(m, end, states[k])
        loads += load
        squares += pressed
        speeds += states[k, turning]
    loads, speeds, squares = loads / len(states), speeds / len(states), squares / len(states)
    course[LOAD_TORQUE] = law[0] * loads
    course[SPEED_TORQUE] = speed_torque(speeds / (2.0 * math.pi), law[1], law[2], law[3])
    course[SPIN_INNER], course[SPIN_OUTER] = law[4] * squares, law[5] * squares
