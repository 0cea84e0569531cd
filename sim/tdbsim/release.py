"""State at the release: positions and velocities of all bodies, for one drop or several drops of one rotor at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tdbsim import state_layout
from tdbsim.cache import compiled
from tdbsim.columns import (
    CAGE_ANGLE,
    GAP,
    MAGNET_DAMPING,
    MAGNET_FX,
    MAGNET_FY,
    MAGNET_STIFFNESS,
    RING_ANGLE,
    SHAPE_REACH,
)
from tdbsim.drop_model import Array, Arrays, DropModel
from tdbsim.errors import InputError
from tdbsim.lane_rows import of_lane
from tdbsim.levitation import Levitation, Whirl, driving, levitation
from tdbsim.machine import Machine
from tdbsim.rhs import touching
from tdbsim.standstill import rest

if TYPE_CHECKING:
    from tdbsim.simulate import DropPlan

OF_THE_ROTOR = ("square", "damping", "gyro", "at_end", "weight")
_PLACES = 72  # points of a levitated orbit at which its distance to a bore that is not round is evaluated
_FASTEST_SURFACE = 1000.0  # m/s: twice the surface speed of the strongest shafts


def side_by_side(models: Sequence[DropModel]) -> Arrays:
    """Return the arrays of models of one rotor: the rotor's from the first model, the others stacked along a first axis."""
    first = models[0].arrays
    return Arrays(
        *(
            getattr(first, name) if name in OF_THE_ROTOR else np.array([getattr(m.arrays, name) for m in models])
            for name in Arrays._fields
        )
    )


def alone(model: DropModel) -> Arrays:
    """Return `side_by_side` of a single model, without copies."""
    return Arrays(
        *(each if name in OF_THE_ROTOR else each[None] for name, each in zip(Arrays._fields, model.arrays, strict=True))
    )


def chosen(arrays: Arrays, drops: int | Sequence[int]) -> Arrays:
    """Return the arrays of one of several drops, in the form of a model, or of some of them."""
    return Arrays(
        *(each if name in OF_THE_ROTOR else each[drops] for name, each in zip(Arrays._fields, arrays, strict=True))
    )


def begin(
    arrays: Arrays, models: Sequence[DropModel], plans: Sequence[DropPlan]
) -> tuple[Array, Whirl, list[InputError | None]]:
    """Return the states (drops, size) at the release, the whirl (drops, n) before it, and the fault of each impossible drop.

    Parameters
    ----------
    arrays : Arrays
        Of the drops, from `side_by_side`; angles and magnetic forces are set according to the plans.
    models : sequence of DropModel
    plans : sequence of DropPlan

    Returns
    -------
    start : (drops, size) array
    whirl : (drops, n) complex array
        Of the levitated rotor, in modal coordinates at shaft angle zero: x + i y = whirl exp(i angle), m.
    faults : list of InputError or None
    """
    for column, angles in ((CAGE_ANGLE, "cage_angle"), (RING_ANGLE, "ring_angle")):
        arrays.end[:, :, column] = [getattr(plan, angles) for plan in plans]
    omega = np.array([m.machine.sense * 2 * math.pi * plan.speed for m, plan in zip(models, plans, strict=True)])
    held, which, faults = _levitations(arrays, models, plans, omega)
    n, count = models[0].n, len(models)
    start, whirl = np.zeros((count, state_layout.size(n))), np.zeros((count, n), dtype=complex)
    if not held:
        return start, whirl, faults
    said = np.empty((count, 2, 3))
    angle = np.array([plan.shaft_angle for plan in plans], dtype=float)
    set_point, velocity = (
        np.array([getattr(plan, each) for plan in plans], dtype=float) for each in ("set_point", "velocity")
    )
    _fill(arrays, held, which, driving(arrays, omega), omega, angle, set_point, velocity, start, whirl, said)
    for k, (model, ends) in enumerate(zip(models, said.tolist(), strict=True)):
        for end in range(2):
            if faults[k] is None:
                faults[k] = _fault(model.machine.ends[end], ends[end], arrays, k, end, start[k], whirl[k])
    return start, whirl, faults


def _levitations(
    arrays: Arrays, models: Sequence[DropModel], plans: Sequence[DropPlan], omega: Array
) -> tuple[tuple[Array, ...], NDArray[np.intp], list[InputError | None]]:
    """Return the `Levitation` attributes of distinct rotors, stacked along a first axis, the index of each drop's, and faults."""
    faults: list[InputError | None] = [None] * len(models)
    which = np.zeros(len(models), dtype=np.intp)
    known: dict[Levitation, int] = {}
    for k, (model, plan) in enumerate(zip(models, plans, strict=True)):
        try:
            check_speed(model.machine, plan)
            which[k] = known.setdefault(levitation(chosen(arrays, k), float(omega[k])), len(known))
        except InputError as error:
            faults[k] = error
    return (
        tuple(np.array([getattr(each, f.name) for each in known]) for f in fields(Levitation)) if known else (),
        which,
        faults,
    )


def _fault(
    name: str, said: Sequence[float], arrays: Arrays, drop: int, end: int, state: Array, whirl: Whirl
) -> InputError | None:
    """Return the error if the release state of a drop (index `drop`) is impossible at an end, else None."""
    found, offset, orbit = said
    if not found:
        return InputError(f"touchdown_bearing '{name}': its rings have no position of rest; check balls and support")
    gap, reach = float(arrays.end[drop, end, GAP]), float(arrays.end[drop, end, SHAPE_REACH])
    if offset + orbit < gap - reach:
        return None
    cure = "check set-point, unbalance and speed"
    if reach > 0.0:  # effects make the bore wider in some directions and narrower in others
        depth, gap = _nearest(chosen(arrays, drop), end, state, whirl)
        if depth < 0.0:
            return None
        cure = f"that is the gap there with the effects: {cure}, or make the effects smaller"
    return InputError(
        f"end '{name}': the levitated shaft, {offset * 1e6:.4g} um off the inner ring's centre with an orbit of"
        f" {orbit * 1e6:.4g} um 0-pk, reaches the gap of {gap * 1e6:.4g} um; {cure}"
    )


@compiled
def _nearest(m, end, state, whirl):  # type: ignore[no-untyped-def]
    """Return the greatest depth of a levitated orbit in a bore that is not round, m, and the gap there, m.

    Parameters
    ----------
    m : Arrays
    end : int
    state : (size,) array
        At the release.
    whirl : (n,) complex array
        At shaft angle zero.
    """
    n = len(whirl)
    body, angle = state_layout.bodies(n, end), state[state_layout.shaft_angle(n)]
    orbit, x, y = 0j, -state[body], -state[body + 1]
    for k in range(n):
        orbit += m.at_end[end, k] * whirl[k]
        x += m.at_end[end, k] * state[k]
        y += m.at_end[end, k] * state[n + k]
    now = orbit * complex(math.cos(angle), math.sin(angle))
    x, y = x - now.real, y - now.imag
    deepest, gap = -math.inf, 0.0
    for place in range(_PLACES):
        turn = 2.0 * math.pi * place / _PLACES
        there = complex(x, y) + orbit * complex(math.cos(turn), math.sin(turn))
        _, _, depth, _ = touching(m.end, m.effect, end, there.real, there.imag, m.end[end, RING_ANGLE], 0.0)
        if depth > deepest:
            deepest, gap = depth, abs(there) - depth
    return deepest, gap


def check_speed(machine: Machine, plan: DropPlan) -> None:
    """Raise InputError for a speed that no steel shaft withstands: its unit is wrong."""
    radius = max(section.outer_diameter for section in machine.rotor.sections) / 2
    surface = 2 * math.pi * plan.speed * radius
    if surface > _FASTEST_SURFACE:
        raise InputError(
            f"speed {plan.speed:g} Hz ({60 * plan.speed:g} rpm) gives the shaft's surface, radius {radius * 1e3:g} mm, a speed of"
            f" {surface:.3g} m/s, which no rotor withstands; is the unit right?"
        )


@compiled
def _fill(m, held, which, drives, omega, angle, set_point, velocity, start, whirl, said):  # type: ignore[no-untyped-def]
    """Fill the states at the release, and set the magnetic force there: the steady part and that by the whirl.

    Parameters
    ----------
    m : Arrays
        Of the drops.
    held : tuple of array
        Attributes of `Levitation`, of several rotors.
    which : (drops,) array of int
        Index of each drop's rotor.
    drives : (drops, n) complex array
        Excitation of the whirl.
    omega, angle : (drops,) arrays
        Of the shaft, rad/s and rad.
    set_point, velocity : (drops, 2, 2) arrays
        Of each end (x, y): the mean position, m, and the velocity in excess of the whirl's, m/s.
    start : (drops, size) array
        Zeros, to be filled.
    whirl : (drops, n) complex array
        Filled.
    said : (drops, 2, 3) array
        Filled for each end: whether a rest position of its rings was found, distance of the shaft from the inner ring's centre,
        m, and radius of its orbit, m.
    """
    n = len(m.square)
    rates, turning, ring = state_layout.positions(n), state_layout.shaft_angle(n), state_layout.ring_angle(n, 0)
    still, by_set_point, force, force_by_set_point, compliance = held
    for k in range(len(omega)):
        one, y, speed, rotor = of_lane(m, k), start[k], omega[k], which[k]
        c, s = math.cos(angle[k]), math.sin(angle[k])
        for i in range(n):
            total = 0j
            for j in range(n):
                total += compliance[rotor, i, j] * drives[k, j]
            whirl[k, i] = total
            for axis in range(2):
                mean = still[rotor, axis, i]
                for j in range(4):
                    mean += by_set_point[rotor, axis, i, j] * set_point[k, j // 2, j % 2]
                y[axis * n + i] = mean
        at = one.at_end
        for end in range(2):
            y[ring + end] = one.end[end, RING_ANGLE]
            body = state_layout.bodies(n, end)
            y[body], y[body + 1], y[body + 2], y[body + 3], y[body + 4], y[body + 5], found = rest(one, end)
            x, z, orbit = -y[body], -y[body + 1], 0j
            for i in range(n):
                x += at[end, i] * y[i]
                z += at[end, i] * y[n + i]
                orbit += at[end, i] * whirl[k, i]
            said[k, end, 0], said[k, end, 1], said[k, end, 2] = found, math.hypot(x, z), abs(orbit)
        for i in range(n):
            x, z = whirl[k, i].real * c - whirl[k, i].imag * s, whirl[k, i].real * s + whirl[k, i].imag * c
            y[i] += x
            y[n + i] += z
            y[rates + i], y[rates + n + i] = -speed * z, speed * x
        # the rigid modes give the ends the wanted velocity
        determinant = at[0, 0] * at[1, 1] - at[0, 1] * at[1, 0]
        for axis in range(2):
            first, second, place = velocity[k, 0, axis], velocity[k, 1, axis], rates + axis * n
            y[place] += (at[1, 1] * first - at[0, 1] * second) / determinant
            y[place + 1] += (at[0, 0] * second - at[1, 0] * first) / determinant
        for magnet in range(len(one.magnet)):
            seen = 0j
            for i in range(n):
                seen += one.at_magnet[magnet, i] * whirl[k, i] * complex(c, s)
            pull = complex(one.magnet[magnet, MAGNET_STIFFNESS], speed * one.magnet[magnet, MAGNET_DAMPING]) * seen
            for axis, column, whirling in ((0, MAGNET_FX, pull.real), (1, MAGNET_FY, pull.imag)):
                steady = force[rotor, axis, magnet]
                for j in range(4):
                    steady += force_by_set_point[rotor, axis, magnet, j] * set_point[k, j // 2, j % 2]
                one.magnet[magnet, column] = steady - whirling
        y[turning], y[rates + turning] = angle[k], speed
