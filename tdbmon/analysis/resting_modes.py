"""Natural frequencies of the rotor resting on its touchdown bearings, to identify spectral lines of constant frequency.

Vertically each end is a chain of shaft, contact, inner ring, balls, outer ring with the support's mass, and support spring,
with contact and balls linearised about the static load.  Horizontally the shaft rolls on its ring like a pendulum of
stiffness load over path radius, and the ring rotates with it.  Gyroscopic moments couple the two directions.  Damping is
neglected; at a few percent it does not shift the frequencies noticeably.

With the support's mass the chain is softer than its springs in series: a support mass close to the rotor's share at the
end lowers even the bounce frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eig, eigh
from tdbsim.machine import Machine, TouchdownBearing
from tdbsim.modes import Modes, free_free
from tdbsim.rotor import RotorModel, static_loads

from tdbmon.analysis.rest import ball_travel, path_radius, rest_travel, rolling_mass

Array = NDArray[np.float64]

_BENDING = 10  # free-free bending modes per plane; with the attachment modes the frequencies are exact to 1e-5


@dataclass(frozen=True)
class RestingEnd:
    """Stiffnesses and masses on which the shaft rests at one end (SI).

    Attributes
    ----------
    end : str
    position : float
        Axial position, m.
    load : float
        Static load, N.
    contact, balls, support : float
        Vertical stiffness, linearised about the static load, N/m.
    ring_mass, support_mass : float
        kg; with a support mass of 0 the springs are in series.
    pendulum : float
        Horizontal stiffness, N/m: load over the radius of the shaft centre's path.
    rolling_mass : float
        Effective horizontal mass of the inner ring, which rotates with the rolling shaft, kg: inertia over the journal's
        radius squared.
    """

    end: str
    position: float
    load: float
    contact: float
    balls: float
    support: float
    ring_mass: float
    support_mass: float
    pendulum: float
    rolling_mass: float

    @property
    def series(self) -> float:
        """Stiffness of contact, balls and support in series, N/m: that of the end at low frequency."""
        return 1 / (1 / self.contact + 1 / self.balls + 1 / self.support)


@dataclass(frozen=True, eq=False)
class RestingModes:
    """Natural frequencies at k speeds or stiffnesses, n modes each in order of frequency.

    Attributes
    ----------
    frequencies : (k, n) array
        Hz.
    sideways : (k, n) array
        Share of horizontal motion in each mode's kinetic energy.
    """

    frequencies: Array
    sideways: Array


def resting_ends(machine: Machine, rotor: RotorModel) -> tuple[RestingEnd, ...]:
    """Return stiffnesses and masses of both ends at the machine file's nominal values, without its effects."""
    loads = static_loads(machine, rotor)
    ends = []
    for bearing in machine.touchdown_bearings:
        load = float(loads[bearing.name])
        travel = rest_travel(bearing, load)
        contact = travel.contact / bearing.contact_exponent  # compliance times load, m
        on_balls = load + machine.gravity * bearing.inner_ring_mass
        balls = ball_stiffness(bearing, on_balls)
        ends.append(
            RestingEnd(
                end=bearing.name,
                position=bearing.position,
                load=load,
                contact=load / contact,
                balls=balls,
                support=bearing.support_stiffness.nominal,
                ring_mass=bearing.inner_ring_mass,
                support_mass=bearing.support_mass,
                pendulum=load / path_radius(bearing, travel.total),
                rolling_mass=rolling_mass(bearing),
            )
        )
    return tuple(ends)


def ball_stiffness(bearing: TouchdownBearing, load: float) -> float:
    """Return the stiffness of the balls against displacement of the inner ring at a load, N/m (mean over the cage angle)."""
    clearance = bearing.balls.diametral_clearance.nominal
    step = 0.01 * load
    return 2 * step / (ball_travel(bearing, load + step, clearance) - ball_travel(bearing, load - step, clearance))


def resting_basis(machine: Machine, rotor: RotorModel) -> Modes:
    """Return the free-free modes that serve as the modal basis."""
    positions = [bearing.position for bearing in machine.touchdown_bearings]
    return free_free(rotor, min(_BENDING, len(rotor.plane_mass) - 2 - len(positions)), positions)


def resting_modes(
    basis: Modes, ends: tuple[RestingEnd, ...], speeds_hz: ArrayLike = (0.0,), n: int = 6
) -> RestingModes:
    """Return the first n natural frequencies as a function of speed.

    Parameters
    ----------
    basis : Modes
        Result of `resting_basis`.
    ends : tuple of RestingEnd
    speeds_hz : (k,) array
        Rotor speeds; their sign does not affect the frequencies.
    n : int
        Number of frequencies.
    """
    mass, stiffness, gyro = _matrices(basis, ends)
    found = [_modes(mass, stiffness, 2 * math.pi * speed * gyro, basis.n, n) for speed in np.atleast_1d(speeds_hz)]
    return RestingModes(np.array([f for f, _ in found]), np.array([s for _, s in found]))


def _matrices(basis: Modes, ends: tuple[RestingEnd, ...]) -> tuple[Array, Array, Array]:
    """Return mass, stiffness and gyroscopic matrix in modal coordinates a, b, then ring and support of each end (vertical)."""
    n = basis.n
    size = 2 * n + 2 * len(ends)
    mass, stiffness, gyro = np.eye(size), np.zeros((size, size)), np.zeros((size, size))
    elastic = np.diag((2 * math.pi * basis.frequencies) ** 2)
    stiffness[:n, :n] = stiffness[n : 2 * n, n : 2 * n] = elastic
    gyro[:n, n : 2 * n], gyro[n : 2 * n, :n] = basis.gyro, -basis.gyro
    for i, end in enumerate(ends):
        shape = basis.at(end.position)
        stiffness[:n, :n] += end.pendulum * np.outer(shape, shape)
        mass[:n, :n] += end.rolling_mass * np.outer(shape, shape)
        ring, support = 2 * n + 2 * i, 2 * n + 2 * i + 1
        mass[ring, ring], mass[support, support] = end.ring_mass, end.support_mass
        reach = np.zeros(size)
        reach[n : 2 * n], reach[ring] = shape, -1.0
        stiffness += end.contact * np.outer(reach, reach)
        reach = np.zeros(size)
        reach[ring], reach[support] = 1.0, -1.0
        stiffness += end.balls * np.outer(reach, reach)
        stiffness[support, support] += end.support
    return _condensed(mass, stiffness, gyro)


def _condensed(mass: Array, stiffness: Array, gyro: Array) -> tuple[Array, Array, Array]:
    """Eliminate massless coordinates by static condensation."""
    heavy = np.diag(mass) > 0
    if heavy.all():
        return mass, stiffness, gyro
    light = ~heavy
    coupling = stiffness[np.ix_(light, heavy)]
    rest = stiffness[np.ix_(heavy, heavy)] - coupling.T @ np.linalg.solve(stiffness[np.ix_(light, light)], coupling)
    return mass[np.ix_(heavy, heavy)], rest, gyro[np.ix_(heavy, heavy)]


def _modes(mass: Array, stiffness: Array, gyro: Array, basis: int, n: int) -> tuple[Array, Array]:
    """Return the first n frequencies, Hz, and shares of horizontal motion of M q'' + G q' + K q = 0."""
    size = len(mass)
    if not gyro.any():
        squares, shapes = eigh(stiffness, mass, subset_by_index=(0, min(n, size) - 1))
        values = np.sqrt(np.maximum(squares, 0.0))
    else:
        unit = math.sqrt(float(np.trace(stiffness) / np.trace(mass)))  # scales both halves of the state alike
        inverse = np.linalg.inv(mass)
        state = np.block(
            [[np.zeros((size, size)), np.eye(size)], [-inverse @ stiffness / unit**2, -inverse @ gyro / unit]]
        )
        roots, vectors = eig(state)
        up = roots.imag > 1e-9
        values, shapes = roots[up].imag * unit, vectors[:size, up]
        order = np.argsort(values)[:n]
        values, shapes = values[order], shapes[:, order]
    energy = np.real(np.einsum("in,ij,jn->n", shapes.conj(), mass, shapes))
    flat = shapes[:basis]
    sideways = np.real(np.einsum("in,ij,jn->n", flat.conj(), mass[:basis, :basis], flat))
    return values / (2 * math.pi), sideways / energy
