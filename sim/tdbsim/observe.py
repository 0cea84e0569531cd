"""Forces and energies of states, which no probe measures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tdbsim import state_layout
from tdbsim.ball_bearing import ball_load, ball_press, cage_angle
from tdbsim.cache import compiled
from tdbsim.columns import (
    BALL_COUNT,
    BALL_STIFFNESS,
    CONTACT_POWER,
    CONTACT_STIFFNESS,
    FOUNDATION_MOBILITY,
    FOUNDATION_STIFFNESS,
    GRAVITY,
    INERTIA,
    RING_INERTIA,
    RING_MASS,
    SUPPORT_MASS,
)
from tdbsim.contact import elastic_force
from tdbsim.rhs import contact_forces, touching
from tdbsim.state_layout import HEAT
from tdbsim.support import spring_force

if TYPE_CHECKING:
    from tdbsim.simulate import Trajectory

FORCES = ("force_x", "force_y", "normal_force", "friction_force", "slip_speed", "depth")
ENERGIES = ("lateral", "spin", "ring_spin", "elastic", "weight")

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_NODES = (_NODES + 1) / 2
_WEIGHTS = _WEIGHTS / 2


@dataclass(frozen=True, eq=False)
class Observed:
    """Forces (2, `FORCES`, k), N, m/s and m, ball loads (2, balls, k), N, and energies (`ENERGIES`, k), J, of k states.

    A ball load is that of one ball along its contact, the same in each row.
    """

    forces: NDArray[np.float64]
    loads: NDArray[np.float64]
    energies: NDArray[np.float64]


def observed(trajectory: Trajectory) -> Observed:
    """Return forces and energies of a trajectory, with the gaps and clearances that heat had changed."""
    arrays, states, warmth = trajectory.model.arrays, trajectory.state, trajectory.warmth
    count = len(states)
    forces = np.zeros((2, len(FORCES), count))
    loads = np.zeros((2, arrays.ball_cosine.shape[1], count))
    energies = np.zeros((len(ENERGIES), count))
    borders, columns = (np.array([0, count]), arrays.end[None]) if warmth is None else warmth.stretches(arrays.end)
    own = arrays._replace(end=arrays.end.copy())
    observe_stretches(own, borders, columns, states, forces, loads, energies)
    for end, bearing in enumerate(trajectory.model.machine.touchdown_bearings):
        loads[end] *= bearing.balls.radial_share
    return Observed(forces, loads, energies)


@compiled
def observe_stretches(m, borders, columns, states, forces, loads, energies):  # type: ignore[no-untyped-def]
    """Do as `observe` with columns of both ends (s, 2, columns) that change at samples (s + 1,)."""
    for i in range(len(columns)):
        m.end[:] = columns[i]
        a, b = borders[i], borders[i + 1]
        observe(m, states[a:b], forces[:, :, a:b], loads[:, :, a:b], energies[:, a:b])


@compiled
def observe(m, states, forces, loads, energies):  # type: ignore[no-untyped-def]
    """Fill forces (2, 6, k), radial ball loads (2, b, k) and energies (5, k) of the states (k, size).

    Energies, J: kinetic of the lateral motion of rotor, rings and supports, of the rotor's spin, of the rings' spin; elastic of
    all springs; potential of the weight.
    """
    n = len(m.square)
    nq = state_layout.positions(n)
    for t in range(len(states)):
        y = states[t]
        omega = y[state_layout.omega(n)]
        lateral = 0.0
        elastic_sum = 0.0
        weight = 0.0
        for k in range(n):
            lateral += 0.5 * (y[nq + k] ** 2 + y[nq + n + k] ** 2)
            elastic_sum += 0.5 * m.square[k] * (y[k] ** 2 + y[n + k] ** 2)
            weight -= m.weight[k] * y[n + k]
        turning = 0.0
        for end in range(2):
            row = m.end[end]
            i = state_layout.bodies(n, end)
            j = state_layout.ring_angle(n, end)
            x = 0.0
            z = 0.0
            vx = 0.0
            vy = 0.0
            for k in range(n):
                shape = m.at_end[end, k]
                x += shape * y[k]
                z += shape * y[n + k]
                vx += shape * y[nq + k]
                vy += shape * y[nq + n + k]
            heat = y[state_layout.work(n) + HEAT + end]
            nx, ny, depth, swing = touching(m.end, m.effect, end, x - y[i], z - y[i + 1], y[j], heat)
            elastic = elastic_force(depth, row[CONTACT_STIFFNESS], row[CONTACT_POWER])
            vx -= y[nq + i]
            vy -= y[nq + i + 1]
            fx, fy, normal, rub, slip = contact_forces(m, end, nx, ny, elastic, swing, vx, vy, omega, y[nq + j])
            forces[end, 0, t] = fx
            forces[end, 1, t] = fy
            forces[end, 2, t] = normal
            forces[end, 3, t] = rub
            forces[end, 4, t] = slip
            forces[end, 5, t] = depth
            if depth > 0.0:
                elastic_sum += elastic * depth / (row[CONTACT_POWER] + 2.0)

            ex = y[i] - y[i + 2]
            ey = y[i + 1] - y[i + 3]
            cage = cage_angle(row, y[j])
            along = ex * np.cos(cage) + ey * np.sin(cage)
            across = ey * np.cos(cage) - ex * np.sin(cage)
            for b in range(int(row[BALL_COUNT])):
                press = ball_press(m, end, b, along, across, cage, y[j])
                loads[end, b, t] = ball_load(press, row[BALL_STIFFNESS])
                if press > 0.0:
                    elastic_sum += 0.4 * loads[end, b, t] * press
            sx = y[i + 2] - y[i + 4]
            sy = y[i + 3] - y[i + 5]
            for p in range(len(_NODES)):  # the work against the spring along the straight line to its position
                gx, gy = spring_force(m.end, m.effect, end, _NODES[p] * sx, _NODES[p] * sy)
                elastic_sum -= _WEIGHTS[p] * (gx * sx + gy * sy)
            if row[FOUNDATION_MOBILITY] > 0.0:
                elastic_sum += 0.5 * row[FOUNDATION_STIFFNESS] * (y[i + 4] ** 2 + y[i + 5] ** 2)
                lateral += 0.5 * (y[nq + i + 4] ** 2 + y[nq + i + 5] ** 2) / row[FOUNDATION_MOBILITY]
            lateral += 0.5 * row[RING_MASS] * (y[nq + i] ** 2 + y[nq + i + 1] ** 2)
            lateral += 0.5 * row[SUPPORT_MASS] * (y[nq + i + 2] ** 2 + y[nq + i + 3] ** 2)
            weight += row[RING_MASS] * m.spin[GRAVITY] * y[i + 1]
            turning += 0.5 * row[RING_INERTIA] * y[nq + j] ** 2
        energies[0, t] = lateral
        energies[1, t] = 0.5 * m.spin[INERTIA] * omega**2
        energies[2, t] = turning
        energies[3, t] = elastic_sum
        energies[4, t] = weight
