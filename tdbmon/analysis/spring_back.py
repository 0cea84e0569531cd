"""Relaxation of the gravity sag of a levitated shaft after its release, predicted from the machine file.

Between its magnetic bearings the shaft has its static sag.  When released it vibrates freely in its bending modes.  On a rotating
shaft gyroscopic moments split each mode in two, tilt the shaft and turn the vibration sideways, the more the heavier its wheels:
at the probes of an overhung rotor this exceeds the fall in the first milliseconds.  In the stationary frame, with modal
coordinates q = a + i b (`tdbsim.modes`),
    q'' - i omega G q' + (2 pi frequencies)^2 q = f exp(-t/T),
where f are the modal forces of the magnetic bearings, which decay with the time constant T (T = 0: at once).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from tdbsim.machine import Machine
from tdbsim.modes import Modes, free_free
from tdbsim.rotor import RotorModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_BENDING = 8  # modes: the sag in higher ones is nanometres
_TIMES = 1e-5 * np.arange(5001)  # s, of the tabulated response; a fall is over long before


@dataclass(frozen=True, eq=False)
class Sag:
    """Static sag of a levitated shaft, in modal coordinates.

    Attributes
    ----------
    modes : Modes
        Of the free-free rotor.
    force : (n,) array
        Modal force of the magnetic bearings, upwards, N/sqrt(kg).
    """

    modes: Modes
    force: Array

    def seen(self, maps: Array, probes: list[tuple[float, float]], omega: float) -> SpringBack:
        """Return its relaxation in position coordinates (rows) that are linear combinations of the probe readings.

        Parameters
        ----------
        maps : (r, p) array
            Matrix from the probe readings to the rows.
        probes : list of pair
            Axial position, m, and angle, rad, of each probe.
        omega : float
            Angular speed of the shaft, rad/s, negative clockwise.
        """
        positions, angles = np.array(probes).T
        reading = np.exp(-1j * angles)[:, None] * self.modes.at(positions)[:, 1:]
        return SpringBack(self, omega, np.asarray(maps @ reading))


def sag_of(machine: Machine, rotor: RotorModel) -> Sag | None:
    """Return the levitated sag by the machine file; None unless two magnetic bearings carry a horizontal shaft."""
    at = np.array([each.position for each in machine.magnetic_bearings])
    if len(at) != 2 or at[0] == at[1] or machine.gravity <= 0:
        return None
    held = rotor.total_mass * machine.gravity * np.array(rotor.shares(*at))
    modes = free_free(rotor, _BENDING)
    return Sag(modes, np.asarray(held @ modes.at(at)))


@dataclass(frozen=True, eq=False)
class SpringBack:
    """Relaxation of a sag, as measured in position coordinates (rows).

    Attributes
    ----------
    sag : Sag
    omega : float
        Angular speed of the shaft, rad/s, negative clockwise.
    rows : (r, n - 1) array, complex
        Measured shape of each mode (without the translation): a row reads Re(row q).
    """

    sag: Sag
    omega: float
    rows: Complex

    def mapped(self, maps: Array) -> SpringBack:
        """Return the relaxation in other rows, which are obtained from these by a matrix."""
        return SpringBack(self.sag, self.omega, np.asarray(maps @ self.rows))

    def stiffer(self, factor: float) -> SpringBack:
        """Return the relaxation of a shaft whose bending frequencies are multiplied by a factor."""
        modes = replace(self.sag.modes, frequencies=factor * self.sag.modes.frequencies)
        return SpringBack(Sag(modes, self.sag.force), self.omega, self.rows)

    def path(self, after: Array, decay: float) -> Array:
        """Return the displacement (r, k), m, since the release, at times (k,) after it, s.

        Parameters
        ----------
        after : (k,) array
        decay : float
            Decay time of the magnetic force, s.
        """
        swung = self._sudden
        if decay > 0:  # particular solution that follows the decaying force, and free vibration about it
            stiff = np.diag(self._squares + 1 / decay**2) + 1j * self._turning / decay
            held = np.linalg.solve(stiff, 1j * self.sag.force[1:])
            swung = swung - (self._swing @ np.concatenate([held, -held / decay])).real.T
            swung = swung + (self.rows @ held).real[:, None] * np.exp(-_TIMES / decay)
        return np.array([np.interp(after, _TIMES, row - row[0]) for row in swung])

    @cached_property
    def _sudden(self) -> Array:
        """Displacement of the rows (r, times), m, in the free vibration from the sag at rest, about the straight shaft."""
        stiff = self._squares
        bent = np.where(stiff > 0, 1j * self.sag.force[1:] / np.where(stiff > 0, stiff, 1.0), 0.0)
        return np.asarray((self._swing @ np.concatenate([bent, 0 * bent])).real.T)

    @property
    def _squares(self) -> Array:
        """Squares of the angular frequencies, without the translation; the rotation's is 0."""
        return np.asarray((2 * np.pi * self.sag.modes.frequencies[1:]) ** 2)

    @property
    def _turning(self) -> Array:
        """Gyroscopic matrix times the angular speed, without the translation."""
        return np.asarray(self.omega * self.sag.modes.gyro[1:, 1:])

    @cached_property
    def _swing(self) -> Complex:
        """Response of the rows to a unit initial value of each coordinate and velocity, (times, r, 2 (n - 1))."""
        n = len(self._squares)
        rates = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(self._squares), 1j * self._turning]])
        step = expm(_TIMES[1] * rates)
        seen = [np.hstack([self.rows, np.zeros_like(self.rows)])]
        for _ in _TIMES[1:]:
            seen.append(seen[-1] @ step)
        return np.array(seen)
