"""A drop and the temperatures of its touchdown bearings, integrated together.

At the end of each short interval (`tdbsim.simulate.DropPlan.heat_interval`) drop and thermal network (`tdbsim.heat_network`)
exchange the heat and growth of the interval.

    drop -> network   the work of friction between rotor and ring; the work of the drag on the ring, shared between the races
    network -> drop   growth of shaft, rings and balls: the gap and the clearance of the balls until the next exchange
    within the drop   friction torque of the bearing at the mean load and speed of the interval's samples, as drag on the ring
                      until the next exchange, in addition to the machine's `inner_ring_drag`

Signs follow geometry.  The bore of a warm ring grows outward, away from the shaft: gap = cold gap + bore - shaft.  Growth of the
inner race and of the ball diameter (two radii; divided by the cosine of the contact angle for radial displacement) reduces the
clearance, growth of the outer race increases it.  N. Neisi (doctoral dissertation, LUT University, equations 2.5 to 2.9) agrees
on the races, but adds the inner ring's growth to the depth of rotor in ring, so that a warm ring closes the gap, and adds a
ball's growth of radius to its diameter.  Neither is followed here.

The time constants of the bodies are tenths of a second, so an interval of a millisecond is short; only the torque lags by it.
The elastic energy that growth adds to loaded contacts is booked as supplied from outside (``external``): some millijoules, which
are not taken from the heat.  The radii at which friction acts stay cold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tdbsim.bearing_torque import spin_per_press
from tdbsim.columns import BALL_STIFFNESS, GAP, HALF_CLEARANCE, RING_DRAG
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.heat_exchange import COURSE_COLUMNS, GROWN, RISE, WarmBearings, exchange
from tdbsim.heat_network import Network
from tdbsim.integration import Integration

if TYPE_CHECKING:
    from tdbsim.simulate import DropPlan

Array = NDArray[np.float64]

_ACTING = [GAP, HALF_CLEARANCE, RING_DRAG]  # columns of an end that an exchange changes


@dataclass(frozen=True, eq=False)
class Warmth:
    """Thermal results of a drop at the instants of exchange.

    Attributes
    ----------
    ends : tuple of int
        Indices of the ends whose bearings have heat.
    capacity : (ends, 8) array
        Heat capacities of `NODES`, J/K.
    sample : (i,) array
        Sample of the trajectory at each exchange.
    time : (i,) array
        s after the release.
    course : (ends, i, columns) array
        Columns as in `tdbsim.heat_exchange`; heats are sums since the release.
    acting : (i, 2, 3) array
        Gap, half clearance and drag of both ends from each instant to the next.
    """

    ends: tuple[int, ...]
    capacity: Array
    sample: NDArray[np.intp]
    time: Array
    course: Array
    acting: Array

    @property
    def rise(self) -> Array:
        """Temperature rises (ends, 8, i) of `NODES` over the air, K; of massless nodes during the interval before."""
        return np.moveaxis(self.course[:, :, RISE:GROWN], 1, 2)

    @property
    def grown(self) -> Array:
        """Growths (ends, 5, i) of `GROWTHS` from each instant to the next, m."""
        return np.moveaxis(self.course[:, :, GROWN:], 1, 2)

    def stretches(self, end_columns: Array) -> tuple[NDArray[np.intp], Array]:
        """Return samples (s + 1,) and the columns of both ends (s, 2, columns) between them, from the cold ones."""
        after = self.sample[1:] if len(self.sample) > 1 else self.sample
        columns = np.repeat(end_columns[None], len(after), axis=0)
        columns[:, :, _ACTING] = self.acting[: len(after)]
        return np.concatenate([[0], after + 1]), columns


def warm_bearings(model: DropModel) -> WarmBearings:
    """Return the arrays of a model's bearings with heat."""
    ends, networks, growth, closing, torque = [], [], [], [], []
    for end, bearing in enumerate(model.machine.touchdown_bearings):
        heat = bearing.heat
        if heat is None:
            continue
        body, geometry, law = heat.body(bearing), heat.geometry(bearing), heat.torque(bearing)
        cosine = math.cos(geometry.contact_angle)
        spin = spin_per_press(
            geometry, heat.spin_friction, bearing.balls.rows, float(model.arrays.end[end, BALL_STIFFNESS])
        )
        across = geometry.ball_diameter * cosine / geometry.pitch_diameter
        ends.append(end)
        networks.append(body.network)
        growth.append(body.growth)
        # in the order of GROWTHS: shaft, bore, inner race, outer race, ball
        closing.append([[-1.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0, -2.0 / cosine]])
        torque.append([float(law.of_load(1.0)), law.speed_factor, law.viscosity, law.pitch_diameter, *spin, across])
    stacked = Network(*(np.stack(each) for each in zip(*networks, strict=True)))
    cold = model.arrays.end[ends][:, _ACTING]
    return WarmBearings(np.array(ends), stacked, np.array(growth), np.array(closing), np.array(torque), cold)


class WarmIntegration:
    """Stepwise integration of a drop together with the temperatures."""

    def __init__(self, model: DropModel, plan: DropPlan, start: Array, peak: Array) -> None:
        """Begin as `Integration`, with all nodes at the temperature of the air."""
        self._drop = Integration(model.copy(), plan, start, peak)
        self._bearings = warm_bearings(model)
        self._course = [np.zeros((len(self._bearings.end), COURSE_COLUMNS))]
        self._acting: list[Array] = []
        self._time: list[float] = []
        self._sample: list[int] = []

    def through(self, times: Array, out: Array) -> None:
        """Fill `out` (k, size) with the states at ascending instants (k,), s after the release.

        Raises
        ------
        InputError
            If the integration does not converge, or growth closes the gap.
        """
        drop, end = self._drop, self._drop.model.arrays.end
        stride = max(1, round(drop.plan.heat_interval * drop.plan.sampling))
        passed = self._sample[-1] + 1 if self._sample else 0
        first = 0
        while first < len(times):
            # the first exchange computes the torques at the release
            last = min(first + (stride if self._time else 1), len(times))
            before, since = drop.state.copy(), drop.time
            drop.through(times[first:last], out[first:last])
            course = self._course[-1].copy()
            closed = exchange(
                drop.model.arrays, self._bearings, before, out[first:last], drop.time - since, drop.state, course
            )
            if closed >= 0:
                raise InputError(
                    f"touchdown_bearing '{drop.model.machine.ends[closed]}': thermal growth has closed the gap {drop.time:.4g} s"
                    " after the release; check the values in its heat table"
                )
            self._course.append(course)
            self._acting.append(end[:, _ACTING])
            self._time.append(drop.time)
            self._sample.append(passed + last - 1)
            first = last

    def warmth(self, before: int) -> Warmth:
        """Return the thermal results; `before` : number of the trajectory's samples before the release."""
        return Warmth(
            ends=tuple(int(end) for end in self._bearings.end),
            capacity=self._bearings.network.capacity,
            sample=np.array(self._sample) + before,
            time=np.array(self._time),
            course=np.moveaxis(np.array(self._course[1:]), 0, 1),
            acting=np.array(self._acting),
        )
