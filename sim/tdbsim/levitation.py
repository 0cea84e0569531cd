"""The levitated rotor before the release, in closed form: no transient, since there is nothing to integrate.

The magnetic bearings are springs and dampers about the set-point; their steady force carries the weight.  Unbalance and
bow make the rotor whirl at its speed, p = P exp(i theta), with x + i y = shape . p in the modes of `tdbsim.modes`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tdbsim import state_layout
from tdbsim.cache import compiled
from tdbsim.columns import MAGNET_DAMPING, MAGNET_FX, MAGNET_FY, MAGNET_STIFFNESS
from tdbsim.drop_model import Array, Arrays
from tdbsim.errors import InputError

_RIGID = 2  # modes
_KEPT = 64  # of each kind of factors

Whirl = NDArray[np.complex128]
Factors = tuple[NDArray[Any], NDArray[Any]]


@dataclass(frozen=True)
class _Asked:
    """A levitated rotor; it counts as equal to another of which everything is equal that an answer depends on."""

    arrays: Arrays
    omega: float
    key: bytes

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Asked) and self.key == other.key


def levitate(arrays: Arrays, set_point: Array, omega: float) -> tuple[Array, Array, Whirl]:
    """Return the mean modal displacements (n,) in x and in y, and the whirl (n,) with the shaft's angle at zero.

    The magnets' steady force is set in `arrays`.  Calibration asks for one rotor again and again, since what it changes is
    mostly in the touchdown bearings, the set-point or the unbalance: so the last factors are kept (raises as `check_stable`
    and `hold` do).
    """
    springs = arrays.magnet[:, [MAGNET_STIFFNESS, MAGNET_DAMPING]]
    parts = (
        arrays.square, arrays.damping, arrays.gyro, arrays.circulatory, arrays.at_magnet, springs, np.array(omega),
    )  # fmt: skip
    asked = _Asked(arrays, omega, b"".join(part.tobytes() for part in parts))
    whirl = _answer(_stable_factors(asked), _driving(arrays, omega))
    return *hold(arrays, set_point), whirl


def synchronous_response(arrays: Arrays, omega: float) -> Whirl:
    """Return the whirl P (n,) of the levitated rotor at a speed in rad/s (negative: clockwise).

    (-omega^2 (I - G) + i omega (D + D_m) + K + K_m - i C) P = omega^2 u + K b, with unbalance u and bow b.
    """
    return np.asarray(np.linalg.solve(_dynamic_stiffness(arrays, omega), _driving(arrays, omega)))


@lru_cache(maxsize=_KEPT)
def _stable_factors(asked: _Asked) -> Factors:
    from scipy.linalg import lu_factor

    check_stable(asked.arrays, asked.omega)
    factors: Factors = lu_factor(_dynamic_stiffness(asked.arrays, asked.omega))
    return factors


def _answer(factors: Factors, load: NDArray[Any]) -> NDArray[Any]:
    from scipy.linalg.lapack import dgetrs, zgetrs

    # what `lu_solve` calls, whose checks take ten times as long; it counts the pivots up in place and down again without
    # Python's lock, so each call needs its own: another thread would solve with wrong ones meanwhile
    matrix, pivots = factors
    solution, _ = (zgetrs if np.iscomplexobj(load) else dgetrs)(matrix, pivots.copy(), load)
    return np.asarray(solution)


def _dynamic_stiffness(arrays: Arrays, omega: float) -> Whirl:
    stiffness, damping = _on_magnets(arrays)
    inertia = np.eye(len(arrays.square)) - arrays.gyro
    return np.asarray(-(omega**2) * inertia + 1j * omega * damping + stiffness - 1j * arrays.circulatory)


def _on_magnets(arrays: Arrays) -> tuple[Array, Array]:
    """Return stiffness and damping (n, n) of the rotor's modes on the magnetic bearings."""
    magnets, at = arrays.magnet, arrays.at_magnet
    stiffness = np.diag(arrays.square) + at.T @ (magnets[:, MAGNET_STIFFNESS, None] * at)
    return stiffness, np.diag(arrays.damping) + at.T @ (magnets[:, MAGNET_DAMPING, None] * at)


def _driving(arrays: Arrays, omega: float) -> Whirl:
    unbalance = arrays.unbalance[0] + 1j * arrays.unbalance[1]
    bow = arrays.bow[0] + 1j * arrays.bow[1]
    return np.asarray(omega**2 * unbalance + arrays.square * bow)


def hold(arrays: Arrays, set_point: Array) -> tuple[Array, Array]:
    """Set the magnets' steady force, and return the mean modal displacements (n,) in x and in y.

    Parameters
    ----------
    arrays : Arrays
        Their ``magnet`` is completed in place.
    set_point : (2, 2) array
        Mean position (x, y) of the shaft's centre at the plane of each touchdown bearing, m.

    Raises
    ------
    InputError
        If there are fewer than two magnetic bearings, or all stand in one plane.
    """
    stiffness = arrays.magnet[:, MAGNET_STIFFNESS]
    parts = arrays.square, arrays.circulatory, arrays.at_end, arrays.at_magnet, stiffness
    share, factors = _holding_factors(_Asked(arrays, 0.0, b"".join(part.tobytes() for part in parts)))
    n = len(arrays.square)
    load = np.zeros(2 * n + 4)
    load[n : 2 * n], load[2 * n : 2 * n + 2], load[2 * n + 2 :] = arrays.weight, set_point[:, 0], set_point[:, 1]
    solution = _answer(factors, load)
    arrays.magnet[:, MAGNET_FX] = share @ solution[2 * n : 2 * n + _RIGID]
    arrays.magnet[:, MAGNET_FY] = share @ solution[2 * n + _RIGID :]
    return solution[:n], solution[n : 2 * n]


@lru_cache(maxsize=_KEPT)
def _holding_factors(asked: _Asked) -> tuple[Array, Factors]:
    """Return the force of a magnet a unit modal force (m, 2), and the factors of what is linear in (mean, static force)."""
    from scipy.linalg import lu_factor

    arrays = asked.arrays
    at, magnets = arrays.at_magnet, arrays.magnet
    if len(magnets) < 2 or np.linalg.det(at[:, :_RIGID].T @ at[:, :_RIGID]) < 1e-12 * np.sum(at[:, :_RIGID] ** 2) ** 2:
        raise InputError("two [[magnetic_bearing]] at different positions are needed to hold the rotor before a drop")
    # the forces that balance weight and cross-coupling, shared by magnets in proportion to their stiffness
    weighted = at[:, :_RIGID] * magnets[:, MAGNET_STIFFNESS, None]
    share = weighted @ np.linalg.inv(at[:, :_RIGID].T @ weighted)
    n = len(arrays.square)
    # rigid: force balance; elastic: deflection; ends: where the shaft shall be
    matrix = np.zeros((2 * n + 4, 2 * n + 4))
    elastic = np.arange(2 * n)
    matrix[elastic, elastic] = np.tile(arrays.square, 2)
    matrix[:n, n : 2 * n], matrix[n : 2 * n, :n] = arrays.circulatory, -arrays.circulatory
    matrix[:n, 2 * n : 2 * n + 2] = matrix[n : 2 * n, 2 * n + 2 :] = -at.T @ share
    matrix[2 * n : 2 * n + 2, :n] = matrix[2 * n + 2 :, n : 2 * n] = arrays.at_end
    return share, lu_factor(matrix)


def add_whirl_force(arrays: Arrays, omega: float, whirl: Whirl) -> None:
    """Add to the magnets' steady force what they exert on the whirl (n,) at the instant of the release."""
    seen = arrays.at_magnet @ whirl
    force = -(arrays.magnet[:, MAGNET_STIFFNESS] + 1j * omega * arrays.magnet[:, MAGNET_DAMPING]) * seen
    arrays.magnet[:, MAGNET_FX] += force.real
    arrays.magnet[:, MAGNET_FY] += force.imag


def check_stable(arrays: Arrays, omega: float) -> None:
    """Raise InputError where the levitated rotor would whirl ever wider at a speed in rad/s."""
    springs = arrays.magnet[:, [MAGNET_STIFFNESS, MAGNET_DAMPING]]
    if not arrays.circulatory.any() and springs.min(initial=0.0) >= 0.0 and arrays.damping.min() >= 0.0:
        return  # gyroscopics do no work: without cross-coupling nothing feeds the whirl
    n = len(arrays.square)
    stiffness, damping = _on_magnets(arrays)
    state = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-stiffness + 1j * arrays.circulatory, -damping + 1j * omega * arrays.gyro]]
    )
    growth = float(np.linalg.eigvals(state).real.max())
    if growth > 1e-3:
        raise InputError(
            f"the levitated rotor is not stable at {abs(omega) / (2 * np.pi):g} Hz (it grows by {growth:.3g} a second);"
            " give the magnetic bearings more damping, or less cross-coupled stiffness"
        )


@compiled
def fill_levitated(unturned, time, start, states):  # type: ignore[no-untyped-def]
    """Fill the states (k, size) at times before the release, s and negative, with the steady whirl that leads to `start`.

    Parameters
    ----------
    unturned : (n,) complex array
        The whirl with the shaft's angle at zero.
    time : (k,) array
    start : (size,) array
        State at the release.
    states : (k, size) array
        Filled.
    """
    n = len(unturned)
    nq, turning = state_layout.positions(n), state_layout.shaft_angle(n)
    omega, angle = start[state_layout.omega(n)], start[turning]
    for row in range(len(time)):
        turned = omega * time[row]
        c, s = math.cos(angle + turned), math.sin(angle + turned)
        c0, s0 = math.cos(angle), math.sin(angle)
        states[row] = start
        for k in range(n):
            real, imag = unturned[k].real, unturned[k].imag
            x, y = real * c - imag * s, real * s + imag * c
            states[row, k] += x - (real * c0 - imag * s0)
            states[row, n + k] += y - (real * s0 + imag * c0)
            states[row, nq + k], states[row, nq + n + k] = -omega * y, omega * x
        states[row, turning] = angle + turned
