"""Kinematics of balls and cage while the inner ring turns: rolling on both races (T. A. Harris, Rolling Bearing Analysis).

With balls of diameter d at the contact angle alpha on a pitch circle D and gamma = d cos(alpha)/D, the cage turns at
(1 - gamma)/2 of the ring's speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tdbsim.hertz import BearingGeometry


@dataclass(frozen=True)
class BallMotion:
    """Rates of balls and cage over the speed of the inner ring, with the outer ring fixed.

    Attributes
    ----------
    cage, ring : float
        Of the cage, and of the inner ring relative to the cage.
    roll : float
        Of a ball about its own axis relative to the cage.
    spin_inner, spin_outer : float
        Of a ball relative to each race about the contact normal.
    """

    cage: float
    ring: float
    roll: float
    spin_inner: float
    spin_outer: float


def ball_motion(geometry: BearingGeometry) -> BallMotion:
    """Return the motion of balls that roll on both races and do not spin on the outer one (outer-race control).

    B. J. Hamrock, D. Dowson, Ball Bearing Lubrication (1981): tan(pitch) = sin(alpha)/(cos(alpha) + d/D).  The balls
    then spin on the inner race at sin(alpha) times the ring's speed; at contact angle 0 there is no spin.
    """
    ratio = geometry.ball_diameter / geometry.pitch_diameter
    angle = geometry.contact_angle
    cosine = math.cos(angle)
    pitch = math.atan2(math.sin(angle), cosine + ratio)
    # rolling on both races: omega x r is equal on both sides of each contact
    cage, ring = (1 - ratio * cosine) / 2, (1 + ratio * cosine) / 2
    roll = (1 / ratio - ratio * cosine * cosine) / 2 / math.cos(angle - pitch)
    spun = roll * math.sin(angle - pitch)
    return BallMotion(
        cage=cage,
        ring=ring,
        roll=roll,
        spin_inner=spun + ring * math.sin(angle),
        spin_outer=spun - cage * math.sin(angle),
    )
