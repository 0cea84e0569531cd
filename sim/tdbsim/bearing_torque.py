"""Friction torque of a ball bearing, and the distribution of its heat between the races.

Torque of the whole bearing (A. Palmgren, Grundlagen der Wälzlagertechnik, 1959; T. A. Harris, Rolling Bearing Analysis):
M = M_L + M_v with M_L = f1 P d_m, and M_v = 1e-7 f2 (nu N)^(2/3) d_m^3 above nu N = 2000, else 160e-7 f2 d_m^3, for
viscosity nu in cSt, speed N in rpm, d_m in mm, M_v in N mm.  Balls at a contact angle also spin; a contact then resists
with M_s = 3 mu Q a E/8, with semi-major axis a and the ellipse's integral of the second kind E (H. Poritsky, C. W.
Hewlett, R. E. Coleman, J. Appl. Mech. 14 (1947)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.ball_motion import ball_motion
from tdbsim.cache import inlined
from tdbsim.errors import InputError
from tdbsim.hertz import BearingGeometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TorqueLaw:
    """Palmgren's law of one bearing.

    Attributes
    ----------
    pitch_diameter : float
        m.
    load_factor : float
        f1; about 0.0003 to 0.001, depending on bearing type and load.
    speed_factor : float
        f2; about 0.7 to 2 with grease or oil mist.  The law was measured on lubricated bearings.
    viscosity : float
        Kinematic, m^2/s (1 cSt = 1e-6 m^2/s).
    """

    pitch_diameter: float
    load_factor: float
    speed_factor: float
    viscosity: float

    def __post_init__(self) -> None:
        for name, unit in (("pitch_diameter", "m"), ("load_factor", ""), ("speed_factor", ""), ("viscosity", "m^2/s")):
            value = getattr(self, name)
            if not (math.isfinite(value) and (value > 0 if unit == "m" else value >= 0)):
                raise InputError(f"{name} {value:g} {unit}".rstrip() + " of the torque law is not possible")

    def of_load(self, load: ArrayLike) -> Array:
        """Return M_L, N m, for loads in N."""
        return np.asarray(self.load_factor * np.abs(np.asarray(load, dtype=float)) * self.pitch_diameter)

    def of_speed(self, speed: ArrayLike) -> Array:
        """Return M_v, N m, for ring speeds in Hz; zero at rest."""
        each = np.vectorize(speed_torque.py_func, otypes=[float])
        return np.asarray(each(speed, self.speed_factor, self.viscosity, self.pitch_diameter))


@inlined
def speed_torque(speed, factor, viscosity, pitch_diameter):  # type: ignore[no-untyped-def]
    """Return M_v, N m, at a speed in Hz, with factor f2, viscosity in m^2/s and pitch diameter in m."""
    product = 1e6 * viscosity * 60.0 * abs(speed)
    if product == 0.0:
        return 0.0
    shape = 1e-7 * product ** (2 / 3) if product > 2000.0 else 160e-7
    return 1e-3 * factor * shape * (1e3 * pitch_diameter) ** 3


@inlined
def race_shares(torque, spin_inner, spin_outer, across):  # type: ignore[no-untyped-def]
    """Return the shares of a torque's work that heat the inner and the outer race; their sum is 1.

    Rolling friction is shared in proportion to the races' radii, 1 -+ `across` (equal drag on different radii), so the inner race
    gets less; spin heats the race that the balls spin on.

    Parameters
    ----------
    torque, spin_inner, spin_outer : float
        Total torque on the inner ring, and its parts by spin on each race, N m.
    across : float
        Ball diameter times cos(contact angle) over pitch diameter.
    """
    if torque <= 0.0:
        return 0.5 * (1.0 - across), 0.5 * (1.0 + across)
    inner = (0.5 * (torque - spin_inner - spin_outer) * (1.0 - across) + spin_inner) / torque
    return inner, 1.0 - inner


def spin_per_press(geometry: BearingGeometry, friction: float, rows: int, stiffness: float) -> tuple[float, float]:
    """Return the torque on the inner ring by ball spin on the inner and on the outer race, per squared compression, N m/m^2.

    A ball compressed by delta carries Q = K delta^(3/2), and its spin moment grows with Q^(4/3): the torque is this value times
    the sum of delta^2.

    Parameters
    ----------
    geometry : BearingGeometry
    friction : float
        Coefficient of friction in the spinning contact.
    rows : int
        Rows of balls that share the radial load, each along the contact angle.
    stiffness : float
        K of the balls of all rows at an azimuth together, for radial displacement, N/m^1.5.

    Raises
    ------
    InputError
        If the coefficient is negative.
    """
    if not friction >= 0:
        raise InputError(f"friction coefficient {friction:g} of the spinning balls is negative")
    motion = ball_motion(geometry)
    load = stiffness / (rows * math.cos(geometry.contact_angle))  # of a ball of one row, at 1 m
    found = []
    for contact, spin in ((geometry.inner, motion.spin_inner), (geometry.outer, motion.spin_outer)):
        moment = spin_moment(load, friction, float(np.max(contact.semi_axes(1.0))), contact.integrals[1])
        found.append(rows * abs(spin) * float(moment))
    return found[0], found[1]


def spin_moment(load: ArrayLike, friction: float, major_a_newton: float, second_kind: float) -> Array:
    """Return M_s = 3 mu Q a E/8, N m, of a spinning contact.

    Parameters
    ----------
    load : array
        Q, N.
    friction : float
        mu.
    major_a_newton : float
        Semi-major axis at 1 N, m; it grows with the cube root of the load.
    second_kind : float
        E of the ellipse.
    """
    positive = np.maximum(np.asarray(load, dtype=float), 0.0)
    return np.asarray(0.375 * friction * second_kind * major_a_newton * positive * np.cbrt(positive))
