"""How long the steps of the splitting may be on a machine."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tdbsim.columns import (
    BALL_COUNT,
    BALL_STIFFNESS,
    FOUNDATION_MOBILITY,
    FOUNDATION_STIFFNESS,
    HALF_CLEARANCE,
    RING_MASS,
    SUPPORT_MASS,
    SUPPORT_XX,
    SUPPORT_XY,
    SUPPORT_YY,
)
from tdbsim.machine import TouchdownBearing
from tdbsim.power_law import scaled_stiffness

if TYPE_CHECKING:
    from tdbsim.drop_model import DropModel

_LONGEST = 25e-6  # s
_DEPTH = 5e-6  # m, of an ordinary contact
_TURN = 0.75  # rad, that a ring may swing in a step; beyond, the error grows as the fifth power and more
_WITH_SHAFT = 1.25  # rad, that ring and shaft may swing on each other: there a first force is right to 0.3 %
# rad, that the rings may swing on balls, support and foundation; a step of three times as much runs away, and those in free
# flight and of long coast-downs are twice the usual one each
_RINGS = 2.5
_SHORTER = 1.5  # rad, where that is too much


def usual_step(model: DropModel) -> float:
    """Return the step, s, at which a drop is right to some nanometres at its first contacts.

    It goes by the fastest motions that the splitting does not follow exactly.  Mostly that is the swing of an inner ring on the
    stiffness of its contact with the shaft: a light ring asks for short steps.  So do a shaft as light as the rings, and a
    support, a foundation or balls as stiff as if they were rigid: steps are then a whole part of what they were.
    """
    ends = model.machine.touchdown_bearings
    fastest = 0.0
    for bearing in ends:
        fastest = max(fastest, math.sqrt(_contact(bearing) / bearing.inner_ring_mass))
    step = min(_LONGEST, _TURN / fastest)
    parts = 1
    for bearing, row, shape in zip(ends, model.arrays.end, model.arrays.at_end, strict=True):
        light = float(shape @ shape) + 1 / bearing.inner_ring_mass
        parts = max(parts, math.ceil(step * math.sqrt(_contact(bearing) * light) / _WITH_SHAFT))
        turn = step * _fastest_ring(row, _contact(bearing) * _DEPTH / bearing.contact_exponent)
        if turn > _RINGS:
            parts = max(parts, math.ceil(turn / _SHORTER))
    return step / parts


def _contact(bearing: TouchdownBearing) -> float:
    """Return the stiffness of an ordinary contact of shaft and ring, N/m."""
    exponent = bearing.contact_exponent
    return exponent * scaled_stiffness(bearing.contact_stiffness, exponent) * _DEPTH ** (exponent - 1)


def _fastest_ring(row: NDArray[np.float64], force: float) -> float:
    """Return the highest natural frequency, rad/s, of an end's rings and foundation under a force, N, on one ball."""
    balls = 1.5 * row[BALL_STIFFNESS] ** (2 / 3) * force ** (1 / 3)
    preloaded = 1.5 * row[BALL_STIFFNESS] * math.sqrt(max(-row[HALF_CLEARANCE], 0.0)) * row[BALL_COUNT] / 2
    balls = max(balls, preloaded)
    middle, half = (row[SUPPORT_XX] + row[SUPPORT_YY]) / 2, (row[SUPPORT_XX] - row[SUPPORT_YY]) / 2
    support = middle + math.hypot(half, row[SUPPORT_XY])
    foundation = row[FOUNDATION_STIFFNESS]
    stiffness = np.array(
        [[balls, -balls, 0.0], [-balls, balls + support, -support], [0.0, -support, support + foundation]]
    )
    light = np.sqrt([1 / row[RING_MASS], 1 / row[SUPPORT_MASS], row[FOUNDATION_MOBILITY]])
    return math.sqrt(float(np.linalg.eigvalsh(stiffness * np.outer(light, light))[-1]))
