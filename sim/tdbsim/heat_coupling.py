"""A drop and the temperatures of its touchdown bearings, integrated together.

At the end of each short interval (`tdbsim.simulate.DropPlan.heat_interval`) drop and network of temperatures
(`tdbsim.heat_network`) exchange what they did to each other in it.

    drop -> network   the work of friction between rotor and ring; the work of the drag on the ring, shared between the races
    network -> drop   growth of shaft, rings and balls: the gap and the clearance of the balls until the next exchange
    within the drop   torque inside the bearing by the mean over the interval's samples of load and speed, as drag on
                      the ring until the next exchange, beside the machine's `inner_ring_drag`

Signs are those of geometry.  A warm ring's bore grows outward, away from the shaft: gap = cold gap + bore - shaft.  Balls are
pressed by the growth of the inner race and of their diameter (two radii; against a radial displacement over the cosine of
the contact angle), and freed by that of the outer race.  The source (N. Neisi, doctoral dissertation, LUT University,
equations 2.5 to 2.9) agrees on the races, but adds the inner ring's growth to the depth of rotor in ring, so that its warm
ring closes the gap; and adds a ball's growth of radius to its diameter.  Here neither is followed.

The time constants of the bodies are tenths of a second, so an interval of a millisecond is short; what lags by it is the
torque.  The elastic energy that growth puts into pressed contacts is booked as supplied from outside (``external``): some
millijoules, which the heat does not miss.  The radii at which friction acts stay cold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdbsim import hooks
from tdbsim.ball_bearing import ball_load
from tdbsim.bearing_torque import race_shares, speed_torque, spin_per_press
from tdbsim.cache import compiled, inlined
from tdbsim.columns import (
    BALL_COUNT,
    BALL_STIFFNESS,
    CAGE_ANGLE,
    CAGE_RATIO,
    CONTACT_POWER,
    CONTACT_STIFFNESS,
    GAP,
    HALF_CLEARANCE,
    HAS_WAVES,
    RING_ANGLE,
    RING_DRAG,
)
from tdbsim.contact import elastic_force
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.heat_network import GROWTHS, NODES, Network, warm
from tdbsim.integration import Integration
from tdbsim.rhs import DRAGGED, EXTERNAL, HEAT, RUBBED, positions, touching

Array = NDArray[np.float64]

# columns of a bearing's course: torques that act from an instant on, N m; heats until then, J; temperatures, K; growths, m
LOAD_TORQUE, SPEED_TORQUE, SPIN_INNER, SPIN_OUTER, RUB_HEAT, INNER_HEAT, OUTER_HEAT, LOST = range(8)
_RISE = LOST + 1
_GROWN = _RISE + len(NODES)
_COURSE_COLUMNS = _GROWN + len(GROWTHS)
_ACTING = [GAP, HALF_CLEARANCE, RING_DRAG]  # columns of an end that the exchange changes


class WarmBearing(NamedTuple):
    """Numbers of a bearing with heat.

    ``network``; ``growth`` (5, 8), m/K; ``closing`` (2, 5) how gap and half clearance follow from the growths; ``torque``
    (7,) load torque a newton, f2, viscosity, pitch diameter, spin torques (`spin_per_press`), ball over pitch diameter.
    """

    network: Network
    growth: Array
    closing: Array
    torque: Array


@dataclass(frozen=True, eq=False)
class Warmth:
    """What heat did in a drop, at the instants of exchange.

    Attributes
    ----------
    ends : tuple of int
        Indices of the ends whose bearings have heat.
    sample : (i,) array
        Of the trajectory, at which each exchange took place.
    time : (i,) array
        s after the release.
    course : (ends, i, columns) array
        See the columns of this module; heats are sums since the release.
    acting : (i, 2, 3) array
        Gap, half clearance and drag of both ends from each instant to the next.
    """

    ends: tuple[int, ...]
    sample: NDArray[np.intp]
    time: Array
    course: Array
    acting: Array

    @property
    def rise(self) -> Array:
        """Temperatures (ends, 8, i) of `NODES` over the air, K; of massless nodes during the interval before."""
        return np.moveaxis(self.course[:, :, _RISE:_GROWN], 1, 2)

    @property
    def grown(self) -> Array:
        """Growths (ends, 5, i) of `GROWTHS` from each instant to the next, m."""
        return np.moveaxis(self.course[:, :, _GROWN:], 1, 2)

    def stretches(self, end_columns: Array) -> list[tuple[slice, Array]]:
        """Return the samples between exchanges, and the columns of both ends that acted there, made of cold ones."""
        found = []
        borders = [0, *(self.sample[1:] + 1)]
        for i in range(len(borders) - 1):
            columns = end_columns.copy()
            columns[:, _ACTING] = self.acting[i]
            found.append((slice(borders[i], borders[i + 1]), columns))
        return found


def warm_bearings(model: DropModel) -> dict[int, WarmBearing]:
    """Return the numbers of the bearings of a model that have heat, by end."""
    found = {}
    for end, bearing in enumerate(model.machine.touchdown_bearings):
        heat = bearing.heat
        if heat is None:
            continue
        body, geometry = heat.body(bearing), heat.geometry(bearing)
        cosine = math.cos(geometry.contact_angle)
        spin = spin_per_press(geometry, heat.spin_friction, heat.rows, float(model.arrays.end[end, BALL_STIFFNESS]))
        law = heat.torque(bearing)
        across = geometry.ball_diameter * cosine / geometry.pitch_diameter
        torque = [float(law.of_load(1.0)), law.speed_factor, law.viscosity, law.pitch_diameter, *spin, across]
        # in the order of GROWTHS: shaft, bore, inner race, outer race, ball
        closing = np.array([[-1.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0, -2.0 / cosine]])
        found[end] = WarmBearing(body.network, body.growth, closing, np.array(torque))
    return found


class WarmIntegration:
    """An integration of drop and temperatures that has reached an instant."""

    def __init__(self, cold: Integration) -> None:
        """Begin at the temperature of the air; the model of `cold` is to be this integration's own."""
        self._drop = cold
        self._bearings = warm_bearings(cold.model)
        self._drag = cold.model.arrays.end[:, RING_DRAG].copy()
        self._cold = cold.model.arrays.end[:, [GAP, HALF_CLEARANCE]].copy()
        self._course: list[Array] = []
        self._acting: list[Array] = []
        self._time: list[float] = []
        self._sample: list[int] = []
        self._samples = 0

    def through(self, times: Array, out: Array) -> None:
        """Fill `out` (k, size) with the states at rising instants (k,), s after the release.

        Raises
        ------
        InputError
            If the integration does not converge, or the ring grows onto the shaft.
        """
        stride = max(1, round(self._drop.plan.heat_interval * self._drop.plan.sampling))
        first = 0
        while first < len(times):
            # the first exchange finds the torques at the release
            last = min(first + (stride if self._time else 1), len(times))
            before, since = self._drop.state.copy(), self._drop.time
            self._drop.through(times[first:last], out[first:last])
            self._exchange(before, since, out[first:last])
            self._samples += last - first
            self._sample.append(self._samples - 1)
            first = last

    def warmth(self, before: int) -> Warmth:
        """Return what heat did; `before` samples of the trajectory are before the release."""
        course = np.moveaxis(np.array(self._course), 0, 1)
        sample = np.array(self._sample) + before
        return Warmth(tuple(self._bearings), sample, np.array(self._time), course, np.array(self._acting))

    def _exchange(self, before: Array, since: float, states: Array) -> None:
        drop = self._drop
        arrays = drop.model.arrays
        old = self._course[-1] if self._course else np.zeros((len(self._bearings), _COURSE_COLUMNS))
        new = old.copy()
        for row, (end, bearing) in zip(new, self._bearings.items(), strict=True):
            exchange(arrays, end, bearing, before, states, drop.time - since, row)
        for row, (end, bearing) in zip(new, self._bearings.items(), strict=True):
            grow(arrays, end, bearing, drop.state, self._cold[end], self._drag[end], row)
            if not arrays.end[end, GAP] > 0:
                name = drop.model.machine.ends[end]
                raise InputError(
                    f"touchdown_bearing '{name}': growth has closed the gap {drop.time:.4g} s after the release;"
                    " check the values of its heat"
                )
        self._course.append(new)
        self._acting.append(arrays.end[:, _ACTING])
        self._time.append(drop.time)


@inlined
def pressed_balls(m, end, y):  # type: ignore[no-untyped-def]
    """Return the resultant of the balls' loads, N, the sum of their squared presses, m^2, and their elastic energy, J."""
    row = m.end[end]
    n = len(m.square)
    i, ring = 2 * n + 6 * end, y[2 * n + 13 + end]
    cage = row[CAGE_ANGLE] + row[CAGE_RATIO] * (ring - row[RING_ANGLE])
    cosine, sine = math.cos(cage), math.sin(cage)
    ex, ey = y[i] - y[i + 2], y[i + 1] - y[i + 3]
    u, v = ex * cosine + ey * sine, ey * cosine - ex * sine
    spacing = 2.0 * math.pi / row[BALL_COUNT]
    along, across, squares, energy = 0.0, 0.0, 0.0, 0.0
    for j in range(int(row[BALL_COUNT])):
        press = u * m.ball_cosine[end, j] + v * m.ball_sine[end, j] - row[HALF_CLEARANCE] + m.ball_oversize[end, j]
        if row[HAS_WAVES] > 0.0:
            press += hooks.ball(cage + j * spacing, ring, m.effect[end])
        if press > 0.0:
            load = ball_load(press, row[BALL_STIFFNESS])
            along += load * m.ball_cosine[end, j]
            across += load * m.ball_sine[end, j]
            squares += press * press
            energy += 0.4 * load * press
    return math.hypot(along, across), squares, energy


@inlined
def elastic_energy(m, end, y):  # type: ignore[no-untyped-def]
    """Return the energy in the contacts of rotor, ring and balls, J."""
    row = m.end[end]
    n = len(m.square)
    i = 2 * n + 6 * end
    x, z = 0.0, 0.0
    for k in range(n):
        x += m.at_end[end, k] * y[k]
        z += m.at_end[end, k] * y[n + k]
    heat = y[2 * positions(n) + HEAT + end]
    _, _, depth, _ = touching(m.end, m.effect, end, x - y[i], z - y[i + 1], y[2 * n + 13 + end], heat)
    _, _, balls = pressed_balls(m, end, y)
    if depth <= 0.0:
        return balls
    return balls + elastic_force(depth, row[CONTACT_STIFFNESS], row[CONTACT_POWER]) * depth / (row[CONTACT_POWER] + 2.0)


@compiled
def exchange(m, end, bearing, before, states, step, course):  # type: ignore[no-untyped-def]
    """Give the network of a bearing the heat of an interval, and find the torques that act after it.

    Parameters
    ----------
    m : Arrays
        As they acted in the interval.
    end : int
    bearing : WarmBearing
    before : (size,) array
        State at the beginning.
    states : (k, size) array
        At the samples of the interval, the last at its end.
    step : float
        Length of the interval, s; 0 at the release.
    course : (columns,) array
        At the beginning; at the end on return, but for growths.
    """
    n = len(m.square)
    nq = positions(n)
    ledger = 2 * nq
    torque = bearing.torque
    after = states[len(states) - 1]
    if step > 0.0:
        rubbed = after[ledger + RUBBED + end] - before[ledger + RUBBED + end]
        # the ledger holds the drag's work at both ends: each has its torque times the angle that its ring turned
        mine, both = 0.0, 0.0
        for other in range(2):
            share = m.end[other, RING_DRAG] * abs(after[2 * n + 13 + other] - before[2 * n + 13 + other])
            both += share
            if other == end:
                mine = share
        dragged = (after[ledger + DRAGGED] - before[ledger + DRAGGED]) * mine / both if both > 0.0 else 0.0
        inner, outer = race_shares(m.end[end, RING_DRAG], course[SPIN_INNER], course[SPIN_OUTER], torque[6])
        inner, outer = inner * dragged, outer * dragged
        shaft_speed = before[nq + 2 * n + 12] / (2.0 * math.pi)
        ring_speed = before[nq + 2 * n + 13 + end] / (2.0 * math.pi)
        rise = course[_RISE:_GROWN]
        course[LOST] += warm(bearing.network, rise, step, rubbed, inner, outer, shaft_speed, ring_speed)
        course[RUB_HEAT] += rubbed
        course[INNER_HEAT] += inner
        course[OUTER_HEAT] += outer
    load_torque, by_speed, squares = 0.0, 0.0, 0.0
    for k in range(len(states)):
        load, pressed, _ = pressed_balls(m, end, states[k])
        load_torque += torque[0] * load
        squares += pressed
        by_speed += speed_torque(states[k, nq + 2 * n + 13 + end] / (2.0 * math.pi), torque[1], torque[2], torque[3])
    course[LOAD_TORQUE], course[SPEED_TORQUE] = load_torque / len(states), by_speed / len(states)
    course[SPIN_INNER], course[SPIN_OUTER] = torque[4] * squares / len(states), torque[5] * squares / len(states)


@compiled
def grow(m, end, bearing, y, cold, drag, course):  # type: ignore[no-untyped-def]
    """Let an end's gap, clearance and drag follow temperatures and torques; book the work of growth in the state `y`.

    Parameters
    ----------
    m : Arrays
        Its columns of the end are changed.
    end : int
    bearing : WarmBearing
    y : (size,) array
    cold : (2,) array
        Gap and half clearance without growth, m.
    drag : float
        The machine's own, N m.
    course : (columns,) array
        Its growths are filled.
    """
    row = m.end[end]
    stored = elastic_energy(m, end, y)
    gap, half_clearance = cold[0], cold[1]
    for part in range(len(bearing.growth)):
        grown = 0.0
        for node in range(_GROWN - _RISE):
            grown += bearing.growth[part, node] * course[_RISE + node]
        course[_GROWN + part] = grown
        gap += bearing.closing[0, part] * grown
        half_clearance += bearing.closing[1, part] * grown
    row[GAP], row[HALF_CLEARANCE] = gap, half_clearance
    row[RING_DRAG] = drag + course[LOAD_TORQUE] + course[SPEED_TORQUE] + course[SPIN_INNER] + course[SPIN_OUTER]
    y[2 * positions(len(m.square)) + EXTERNAL] += elastic_energy(m, end, y) - stored
