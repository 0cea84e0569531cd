"""Friction torque and heat inside a ball bearing, of histories of load and speed.

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
        f1; about 0.0003 to 0.001, by the bearing's kind and load.
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
        """Return M_v, N m, for ring speeds in Hz; nothing drags a ring at rest."""
        product = 1e6 * self.viscosity * 60 * np.abs(np.asarray(speed, dtype=float))
        shape = np.where(product > 2000, 1e-7 * np.cbrt(np.maximum(product, 2000.0)) ** 2, 160e-7)
        in_n_mm = self.speed_factor * shape * (1e3 * self.pitch_diameter) ** 3
        return np.where(product > 0, 1e-3 * in_n_mm, 0.0)

    def total(self, load: ArrayLike, speed: ArrayLike) -> Array:
        """Return M_L + M_v, N m."""
        return self.of_load(load) + self.of_speed(speed)


@dataclass(frozen=True)
class BallMotion:
    """How balls move while the inner ring turns and the outer one stands; rates a rate of the inner ring.

    Attributes
    ----------
    cage, roll : float
        Of the cage, and of a ball about its own axis relative to the cage.
    pitch : float
        Angle between the ball's axis and the shaft, rad.
    spin_inner, spin_outer : float
        Of a ball against each race about the normal of the contact.
    """

    cage: float
    roll: float
    pitch: float
    spin_inner: float
    spin_outer: float


def ball_motion(geometry: BearingGeometry) -> BallMotion:
    """Return the motion of balls that roll on both races and do not spin on the outer one (outer-race control).

    B. J. Hamrock, D. Dowson, Ball Bearing Lubrication (1981): tan(pitch) = sin(alpha)/(cos(alpha) + d/d_m).  The balls
    then spin on the inner race with sin(alpha) times the ring's rate; at contact angle 0 nothing spins.
    """
    ratio = geometry.ball_diameter / geometry.pitch_diameter
    angle = geometry.contact_angle
    pitch = math.atan2(math.sin(angle), math.cos(angle) + ratio)
    # rolling on both races fixes cage and ball: omega x r is the same on both sides of each contact
    outer, inner = 1 + ratio * math.cos(angle), 1 - ratio * math.cos(angle)
    cage = inner / (inner + outer)
    roll = cage * outer / (ratio * math.cos(angle - pitch))
    spun = roll * math.sin(angle - pitch)
    return BallMotion(
        cage=cage,
        roll=roll,
        pitch=pitch,
        spin_inner=spun + (1 - cage) * math.sin(angle),
        spin_outer=spun - cage * math.sin(angle),
    )


@dataclass(frozen=True)
class RaceHeat:
    """Heat made at the two races, W, and the torque on the inner ring that pays for it, N m; each (...)."""

    inner: Array
    outer: Array
    torque: Array


def race_heat(
    geometry: BearingGeometry, law: TorqueLaw, ball_load: ArrayLike, load: ArrayLike, speed: ArrayLike, friction: float
) -> RaceHeat:
    """Return the heat at the races; what the torque takes out of the ring, to the last watt.

    Palmgren's torque is shared between the races as their radii (the same drag on a smaller radius), which leaves the
    inner one the cooler; spin adds to the race that the balls spin on.

    Parameters
    ----------
    geometry : BearingGeometry
    law : TorqueLaw
    ball_load : (..., n) array
        N.
    load : (...) array
        Equivalent load of the bearing, N.
    speed : (...) array
        Of the inner ring, Hz.
    friction : float
        Coefficient of a ball spinning on a race.

    Raises
    ------
    InputError
        If the coefficient is negative.
    """
    if not friction >= 0:
        raise InputError(f"friction coefficient {friction:g} of the spinning balls is negative")
    rate = 2 * math.pi * np.abs(np.asarray(speed, dtype=float))
    motion = ball_motion(geometry)
    balls = np.asarray(ball_load, dtype=float)
    across = geometry.ball_diameter * math.cos(geometry.contact_angle) / geometry.pitch_diameter
    drag = law.total(load, speed)
    spins = []
    for contact, spin in ((geometry.inner, motion.spin_inner), (geometry.outer, motion.spin_outer)):
        moment = spin_moment(balls, friction, float(np.max(contact.semi_axes(1.0))), contact.integrals[1])
        spins.append(abs(spin) * np.sum(moment, axis=-1))
    return RaceHeat(
        inner=rate * (drag * (1 - across) / 2 + spins[0]),
        outer=rate * (drag * (1 + across) / 2 + spins[1]),
        torque=drag + spins[0] + spins[1],
    )


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
