"""Steady state of the levitated rotor before the release, in closed form, without a transient.

The magnetic bearings are springs and dampers about the set-point; their steady force carries the weight.  Unbalance and bow
cause synchronous whirl p = P exp(i theta), with x + i y = shape . p in the modes of `tdbsim.modes`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tdbsim import state_layout
from tdbsim.cache import compiled
from tdbsim.columns import MAGNET_DAMPING, MAGNET_STIFFNESS
from tdbsim.drop_model import Array, Arrays
from tdbsim.errors import InputError

_RIGID = 2  # modes
_KEPT = 64  # levitated rotors in the cache

Whirl = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Levitation:
    """Response of the levitated rotor at a speed; linear, so it holds for every set-point and unbalance.

    Attributes
    ----------
    still : (2, n) array
        Static modal displacements in x and in y at a centred set-point, m.
    by_set_point : (2, n, 4) array
        Their derivatives by the set-point (x and y at the first end, then at the second).
    force : (2, m) array
        Steady magnetic force in x and in y at a centred set-point, N.
    force_by_set_point : (2, m, 4) array
        Its derivatives by the set-point, N/m.
    compliance : (n, n) complex array
        From the excitation of the whirl to the whirl.
    """

    still: Array
    by_set_point: Array
    force: Array
    force_by_set_point: Array
    compliance: Whirl


@dataclass(frozen=True)
class _Key:
    """Cache key of a levitated rotor: equal for rotors equal in everything that the response depends on."""

    arrays: Arrays
    omega: float
    key: bytes

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.key == other.key


def levitation(arrays: Arrays, omega: float) -> Levitation:
    """Return the response of the levitated rotor at a speed in rad/s (negative: clockwise).

    The last ones are cached: calibration mostly changes touchdown bearings, set-point or unbalance, so the same rotor recurs.

    Raises
    ------
    InputError
        If the levitated rotor is unstable, there are fewer than two magnetic bearings, or all are in one plane.
    """
    springs = arrays.magnet[:, [MAGNET_STIFFNESS, MAGNET_DAMPING]]
    parts = (
        arrays.square, arrays.damping, arrays.gyro, arrays.weight, arrays.at_end, arrays.circulatory, arrays.at_magnet,
        springs, np.array(omega),
    )  # fmt: skip
    return _levitation(_Key(arrays, omega, b"".join(part.tobytes() for part in parts)))


@lru_cache(maxsize=_KEPT)
def _levitation(asked: _Key) -> Levitation:
    arrays, omega = asked.arrays, asked.omega
    _check_stable(arrays, omega)
    stiffness = arrays.magnet[:, MAGNET_STIFFNESS]
    parts = arrays.square, arrays.circulatory, arrays.at_end, arrays.at_magnet, arrays.weight, stiffness
    held = _static_response(_Key(arrays, 0.0, b"".join(part.tobytes() for part in parts)))
    return Levitation(*held, np.asarray(np.linalg.inv(_dynamic_stiffness(arrays, omega)), dtype=complex))


@lru_cache(maxsize=_KEPT)
def _static_response(asked: _Key) -> tuple[Array, Array, Array, Array]:
    """Return the first four attributes of a `Levitation`, which do not depend on speed."""
    arrays = asked.arrays
    at, magnets = arrays.at_magnet, arrays.magnet
    if len(magnets) < 2 or np.linalg.det(at[:, :_RIGID].T @ at[:, :_RIGID]) < 1e-12 * np.sum(at[:, :_RIGID] ** 2) ** 2:
        raise InputError("two [[magnetic_bearing]] at different positions are needed to hold the rotor before a drop")
    # the forces that balance weight and cross-coupling are distributed in proportion to the magnets' stiffness
    weighted = at[:, :_RIGID] * magnets[:, MAGNET_STIFFNESS, None]
    share = np.asarray(weighted @ np.linalg.inv(at[:, :_RIGID].T @ weighted), dtype=float)
    n = len(arrays.square)
    # linear in (mean, static force): equilibrium of rigid modes, deflection of elastic modes, set-points
    matrix = np.zeros((2 * n + 4, 2 * n + 4))
    elastic = np.arange(2 * n)
    matrix[elastic, elastic] = np.tile(arrays.square, 2)
    matrix[:n, n : 2 * n], matrix[n : 2 * n, :n] = arrays.circulatory, -arrays.circulatory
    matrix[:n, 2 * n : 2 * n + 2] = matrix[n : 2 * n, 2 * n + 2 :] = -at.T @ share
    matrix[2 * n : 2 * n + 2, :n] = matrix[2 * n + 2 :, n : 2 * n] = arrays.at_end
    loads = np.zeros((2 * n + 4, 5))  # weight, then x and y of the one end and of the other
    loads[n : 2 * n, 0] = arrays.weight
    loads[2 * n + np.array([0, 2, 1, 3]), 1 + np.arange(4)] = 1.0
    held = np.asarray(np.linalg.solve(matrix, loads), dtype=float)
    means, forces = held[: 2 * n].reshape(2, n, 5), share @ held[2 * n :].reshape(2, _RIGID, 5)
    return means[..., 0].copy(), means[..., 1:].copy(), forces[..., 0].copy(), forces[..., 1:].copy()


def _dynamic_stiffness(arrays: Arrays, omega: float) -> Whirl:
    """Return the dynamic stiffness (n, n) at a speed in rad/s, whose product with the whirl P (n,) is its excitation.

    (-omega^2 (I - G) + i omega (D + D_m) + K + K_m - i C) P = omega^2 u + K b, with unbalance u and bow b (`driving`).
    """
    stiffness, damping = _on_magnets(arrays)
    inertia = np.eye(len(arrays.square)) - arrays.gyro
    return np.asarray(-(omega**2) * inertia + 1j * omega * damping + stiffness - 1j * arrays.circulatory)


def _on_magnets(arrays: Arrays) -> tuple[Array, Array]:
    """Return stiffness and damping (n, n) of the rotor's modes on the magnetic bearings."""
    magnets, at = arrays.magnet, arrays.at_magnet
    stiffness = np.diag(arrays.square) + at.T @ (magnets[:, MAGNET_STIFFNESS, None] * at)
    return stiffness, np.diag(arrays.damping) + at.T @ (magnets[:, MAGNET_DAMPING, None] * at)


def driving(arrays: Arrays, omega: float | Array) -> Whirl:
    """Return the excitation of the whirl (..., n) at a speed in rad/s, omega^2 u + K b; of several drops along a first axis."""
    unbalance, bow = (each[..., 0, :] + 1j * each[..., 1, :] for each in (arrays.unbalance, arrays.bow))
    return np.asarray(np.square(omega)[..., None] * unbalance + arrays.square * bow)


def _check_stable(arrays: Arrays, omega: float) -> None:
    """Raise InputError where the levitated rotor is unstable at a speed in rad/s."""
    springs = arrays.magnet[:, [MAGNET_STIFFNESS, MAGNET_DAMPING]]
    if not arrays.circulatory.any() and springs.min(initial=0.0) >= 0.0 and arrays.damping.min() >= 0.0:
        return  # gyroscopic forces do no work: without cross-coupling nothing feeds the whirl
    n = len(arrays.square)
    stiffness, damping = _on_magnets(arrays)
    state = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-stiffness + 1j * arrays.circulatory, -damping + 1j * omega * arrays.gyro]]
    )
    growth = float(np.linalg.eigvals(state).real.max())
    if growth > 1e-3:
        raise InputError(
            f"the levitated rotor is not stable at {abs(omega) / (2 * np.pi):g} Hz (its motion grows at {growth:.3g} 1/s);"
            " give the magnetic bearings more damping, or less cross-coupled stiffness"
        )


@compiled
def fill_levitated(unturned, time, start, states):  # type: ignore[no-untyped-def]
    """Fill the states of drops before the release with the steady whirl that continues into `start`.

    Parameters
    ----------
    unturned : (drops, n) complex array
        The whirl with the shaft's angle at zero.
    time : (k,) array
        s after the release, negative.
    start : (drops, size) array
        States at the release.
    states : (drops, at least k, size) array
        Filled.
    """
    n = unturned.shape[1]
    nq, turning, spin = state_layout.positions(n), state_layout.shaft_angle(n), state_layout.omega(n)
    for drop in range(len(unturned)):
        omega, angle = start[drop, spin], start[drop, turning]
        c0, s0 = math.cos(angle), math.sin(angle)
        for row in range(len(time)):
            turned = omega * time[row]
            c, s = math.cos(angle + turned), math.sin(angle + turned)
            state = states[drop, row]
            state[:] = start[drop]
            for k in range(n):
                real, imag = unturned[drop, k].real, unturned[drop, k].imag
                x, y = real * c - imag * s, real * s + imag * c
                state[k] += x - (real * c0 - imag * s0)
                state[n + k] += y - (real * s0 + imag * c0)
                state[nq + k], state[nq + n + k] = -omega * y, omega * x
            state[turning] = angle + turned
