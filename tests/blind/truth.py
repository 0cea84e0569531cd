"""The true machine with its hidden effects, and one drop of it."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.blind.drop import GRAVITY, PER_END, Bearing, Magnets, Rotor, integrate, settle_ring
from tests.blind.machine import Machine
from tests.blind.rotor import Disk, Modes, modes

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RATE = 20_000  # Hz, of the records
LEVITATED = 2000  # samples
LEAD = 64  # samples levitated before the record begins, for late channels
STEPS = 12  # Runge-Kutta steps a sample: 4.2 us
MODES = 26  # a plane


@dataclass(frozen=True)
class Truth:
    """True values; everything from `quadratic_rate` on is off at its default.  Rotating vectors are complex."""

    machine: Machine
    bearings: tuple[Bearing, Bearing]
    unbalance: tuple[complex, ...]  # kg m, one a plane, phase from the keyphasor mark
    decay_time: float
    magnet_stiffness: tuple[float, float]
    magnet_damping: tuple[float, float]
    elastic_modulus: float
    modal_damping: float
    quadratic_rate: float = 0.0  # 1/rad
    bow: complex = 0.0  # m, midway between the touchdown bearings
    seal_position: float = 0.0
    seal_stiffness: complex = 0.0  # N/m; the imaginary part acts across the displacement
    magnet_decay: float = 0.0
    late_plane: int = 0
    late_unbalance: complex = 0.0
    late_time: float = np.inf  # s, in the record
    kick_magnet: int = 0
    kick_force: complex = 0.0  # N, x + i y
    kick_time: float = np.inf
    kick_length: float = 1e-3


@dataclass(frozen=True)
class Start:
    """How a drop begins; angles in rad, the set-point at the magnetic bearings as x + i y, m."""

    speed: float  # rad/s
    shaft_angle: float
    set_point: tuple[complex, complex]
    ring_angle: tuple[float, float]
    cage_angle: tuple[float, float]


@dataclass(frozen=True)
class Drop:
    """The motion of a drop, from `LEAD` samples before the record on.

    places : (samples, probes, 2) m; angle : (samples,) rad; speed, ring_speed : rad/s; force : (samples, 2) N.
    """

    places: Array
    angle: Array
    speed: Array
    ring_speed: Array
    force: Array
    last: Array


@functools.lru_cache(maxsize=4)
def _modes(
    sections: tuple[tuple[float, float], ...], disks: tuple[Disk, ...], young: float, rho: float, nu: float
) -> Modes:
    return modes(list(sections), list(disks), elastic_modulus=young, density=rho, poisson_ratio=nu, count=MODES)


def rotor_modes(truth: Truth) -> Modes:
    """Return the modes of the true rotor."""
    m = truth.machine
    return _modes(tuple(m.sections), tuple(m.disks), truth.elastic_modulus, m.density, m.poisson_ratio)


@dataclass(frozen=True)
class Levitation:
    """The levitated rotor in modal coordinates, x + i y: mean position, holding forces, and whirl at shaft angle 0."""

    place: Complex
    holding: Complex
    whirl: Complex


def levitation(truth: Truth, start: Start) -> Levitation:
    """Return the steady state before the release."""
    shaft = rotor_modes(truth)
    rotor = _rotor(truth, shaft)
    magnet = rotor.magnet
    seal = truth.seal_stiffness * np.outer(rotor.seal, rotor.seal)
    # static deflections with the set-point held, and the holding forces
    n = len(shaft.frequency)
    bordered = np.zeros((n + 2, n + 2), complex)
    bordered[:n, :n] = np.diag(shaft.frequency**2) - seal
    bordered[:n, n:] = -magnet.T
    bordered[n:, :n] = magnet
    still = np.asarray(
        np.linalg.solve(bordered, np.concatenate((-1j * GRAVITY * shaft.weight, start.set_point))), complex
    )
    # steady whirl at the initial speed, q = Q exp(i theta)
    w = start.speed
    spring = np.diag(truth.magnet_stiffness) + 1j * w * np.diag(truth.magnet_damping)
    dynamic = np.diag(shaft.frequency**2 - w**2 + 1j * w * rotor.damping) - seal
    dynamic += w**2 * rotor.gyroscopic + magnet.T @ spring @ magnet
    unbalance = rotor.unbalance[0] + 1j * rotor.unbalance[1]
    bow = rotor.bow[0] + 1j * rotor.bow[1]
    whirl = np.linalg.solve(dynamic, w**2 * unbalance + shaft.frequency**2 * bow)
    return Levitation(still[:n], still[n:], np.asarray(whirl, complex))


def run(truth: Truth, start: Start, *, samples: int = 10_000, levitated: int = LEVITATED, steps: int = STEPS) -> Drop:
    """Return one drop, from `LEAD` samples before the record on."""
    shaft = rotor_modes(truth)
    rotor = _rotor(truth, shaft)
    before = levitation(truth, start)
    n, w = len(shaft.frequency), start.speed
    whirl = before.whirl * np.exp(1j * start.shaft_angle)

    lead = LEAD / RATE
    state = np.zeros(4 * n + 2 + 2 * PER_END)
    place = before.place + whirl
    state[:n], state[n : 2 * n] = place.real, place.imag
    state[2 * n : 3 * n], state[3 * n : 4 * n] = (1j * w * whirl).real, (1j * w * whirl).imag
    state[4 * n : 4 * n + 2] = start.shaft_angle, w
    for e, bearing in enumerate(truth.bearings):
        base = 4 * n + 2 + e * PER_END
        state[base : base + 2] = settle_ring(bearing, start.ring_angle[e], start.cage_angle[e])
        state[base + 4], state[base + 6] = start.ring_angle[e], start.cage_angle[e]
    kick = np.zeros((2, 2))
    kick[truth.kick_magnet] = truth.kick_force.real, truth.kick_force.imag
    magnets = Magnets(
        stiffness=np.array(truth.magnet_stiffness),
        damping=np.array(truth.magnet_damping),
        set_point=_pairs(start.set_point),
        holding=_pairs(before.holding),
        release_time=(LEAD + levitated) / RATE,
        decay_time=truth.magnet_decay,
        kick_time=truth.kick_time + lead,
        kick_length=truth.kick_length,
        kick_force=kick,
    )
    places, turning, force, last = integrate(state, rotor, truth.bearings, magnets, LEAD + samples, 1.0 / RATE, steps)
    return Drop(places, turning[:, 0], turning[:, 1], turning[:, 2:], force, last)


def levitation_growth(truth: Truth, speed: float) -> float:
    """Return the growth rate of the least damped mode in levitation at a speed (rad/s), 1/s; negative if stable."""
    rotor = _rotor(truth, rotor_modes(truth))
    n = 6  # higher modes are better damped
    magnet, seal = rotor.magnet[:, :n], rotor.seal[:n]
    stiffness = np.diag(rotor.frequency[:n] ** 2) + magnet.T @ np.diag(truth.magnet_stiffness) @ magnet
    damping = np.diag(rotor.damping[:n]) + magnet.T @ np.diag(truth.magnet_damping) @ magnet
    motion = np.zeros((2 * n, 2 * n), complex)
    motion[:n, n:] = np.eye(n)
    motion[n:, :n] = -stiffness + truth.seal_stiffness * np.outer(seal, seal)
    motion[n:, n:] = -damping + 1j * speed * rotor.gyroscopic[:n, :n]
    return float(np.linalg.eigvals(motion).real.max())


def _rotor(truth: Truth, shaft: Modes) -> Rotor:
    machine = truth.machine
    bearings = [t.position for t in machine.touchdowns]
    unbalance = sum(u * shaft.at(p.position) for u, p in zip(truth.unbalance, machine.planes, strict=True))
    late = truth.late_unbalance * shaft.at(machine.planes[truth.late_plane].position)
    # a parabola through the bearings
    s = (shaft.nodes - bearings[0]) / (bearings[1] - bearings[0])
    bow = truth.bow * shaft.amplitudes(4 * s * (1 - s), 4 * (1 - 2 * s) / (bearings[1] - bearings[0]))
    return Rotor(
        frequency=shaft.frequency,
        damping=2 * truth.modal_damping * shaft.frequency,
        gyroscopic=np.ascontiguousarray(shaft.gyroscopic),
        weight=shaft.weight,
        polar_inertia=shaft.polar_inertia,
        decay_rate=1.0 / truth.decay_time,
        quadratic_rate=truth.quadratic_rate,
        touchdown=np.array([shaft.at(z) for z in bearings]),
        magnet=np.array([shaft.at(m.position) for m in machine.magnets]),
        probe=np.array([shaft.at(p.position) for p in machine.probes]),
        seal=shaft.at(truth.seal_position),
        seal_direct=float(np.real(truth.seal_stiffness)),
        seal_cross=float(np.imag(truth.seal_stiffness)),
        unbalance=np.array([unbalance.real, unbalance.imag]),
        late_unbalance=np.array([late.real, late.imag]),
        late_time=truth.late_time + LEAD / RATE,
        bow=np.array([bow.real, bow.imag]),
    )


def _pairs(values: Iterable[complex]) -> Array:
    return np.array([[value.real, value.imag] for value in values])
