"""How the sag of a levitated shaft springs back in the fall, by the machine file's rotor and magnetic bearings.

Between its magnetic bearings the shaft sags under its weight as statics has it.  Let go, it swings in its bending modes.  On a
turning rotor gyroscopic moments split these in two, tilt the shaft and turn the swing sideways, the more the heavier its
wheels: at the probes of an overhung rotor by more than it falls in the first milliseconds.  In a frame that stands still, with
modal coordinates q = a + i b (`tdbsim.modes`),
    q'' - i omega G q' + (2 pi frequencies)^2 q = f exp(-t/T),
f the modal forces of the magnetic bearings, whose force dies away in T (at once: T = 0).
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

_BENDING = 8  # modes: what those beyond sag is nanometres
_TIMES = 1e-5 * np.arange(5001)  # s: of the path that is kept; a fall is over long before


@dataclass(frozen=True, eq=False)
class Sag:
    """The levitated sag of a shaft.

    Attributes
    ----------
    modes : Modes
        Of the free rotor.
    force : (n,) array
        Upward force of the magnetic bearings in each mode, N/sqrt(kg).
    """

    modes: Modes
    force: Array

    def seen(self, maps: Array, probes: list[tuple[float, float]], omega: float) -> SpringBack:
        """Return how it springs back, as rows of positions show it.

        Parameters
        ----------
        maps : (r, p) array
            From the probes' readings to the rows.
        probes : list of pair
            Position, m, and angle, rad, of each probe.
        omega : float
            Of the shaft, rad/s, negative clockwise.
        """
        positions, angles = np.array(probes).T
        reading = np.exp(-1j * angles)[:, None] * self.modes.at(positions)[:, 1:]
        return SpringBack(self, omega, np.asarray(maps @ reading))


def sag_of(machine: Machine, rotor: RotorModel) -> Sag | None:
    """Return the levitated sag by the machine file; None unless two magnetic bearings hold a shaft that lies."""
    at = np.array([each.position for each in machine.magnetic_bearings])
    if len(at) != 2 or at[0] == at[1] or machine.gravity <= 0:
        return None
    held = rotor.total_mass * machine.gravity * np.array(rotor.shares(*at))
    modes = free_free(rotor, _BENDING)
    return Sag(modes, np.asarray(held @ modes.at(at)))


@dataclass(frozen=True, eq=False)
class SpringBack:
    """A sag that springs back, as rows of positions show it.

    Attributes
    ----------
    sag : Sag
    omega : float
        Of the shaft, rad/s, negative clockwise.
    rows : (r, n - 1) array, complex
        What each row shows of a mode (without the translation), as Re(row q).
    """

    sag: Sag
    omega: float
    rows: Complex

    def mapped(self, maps: Array) -> SpringBack:
        """Return what other rows show, which a matrix makes of these."""
        return SpringBack(self.sag, self.omega, np.asarray(maps @ self.rows))

    def stiffer(self, factor: float) -> SpringBack:
        """Return that of a shaft whose bending frequencies are so many times as high."""
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
        if decay > 0:  # what follows the force as it dies away, and what swings freely about that
            stiff = np.diag(self._squares + 1 / decay**2) + 1j * self._turning / decay
            held = np.linalg.solve(stiff, 1j * self.sag.force[1:])
            swung = swung - (self._swing @ np.concatenate([held, -held / decay])).real.T
            swung = swung + (self.rows @ held).real[:, None] * np.exp(-_TIMES / decay)
        return np.array([np.interp(after, _TIMES, row - row[0]) for row in swung])

    @cached_property
    def _sudden(self) -> Array:
        """Where the rows are (r, times), m, as the sag swings about the straight shaft from rest."""
        stiff = self._squares
        bent = np.where(stiff > 0, 1j * self.sag.force[1:] / np.where(stiff > 0, stiff, 1.0), 0.0)
        return np.asarray((self._swing @ np.concatenate([bent, 0 * bent])).real.T)

    @property
    def _squares(self) -> Array:
        """Squares of the angular frequencies, without the translation; the rotation's is 0."""
        return np.asarray((2 * np.pi * self.sag.modes.frequencies[1:]) ** 2)

    @property
    def _turning(self) -> Array:
        return np.asarray(self.omega * self.sag.modes.gyro[1:, 1:])

    @cached_property
    def _swing(self) -> Complex:
        """What the rows show of the free motion from each coordinate and velocity alone, (times, r, 2 (n - 1))."""
        n = len(self._squares)
        rates = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(self._squares), 1j * self._turning]])
        step = expm(_TIMES[1] * rates)
        seen = [np.hstack([self.rows, np.zeros_like(self.rows)])]
        for _ in _TIMES[1:]:
            seen.append(seen[-1] @ step)
        return np.array(seen)
