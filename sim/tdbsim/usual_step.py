"""Admissible step of the splitting for a machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tdbsim.columns import (
    BALL_COUNT,
    BALL_DAMPING,
    BALL_STIFFNESS,
    CONTACT_DAMPING,
    FOUNDATION_DAMPING,
    FOUNDATION_MOBILITY,
    FOUNDATION_STIFFNESS,
    HALF_CLEARANCE,
    RING_MASS,
    SUPPORT_DAMPING,
    SUPPORT_MASS,
    SUPPORT_XX,
    SUPPORT_XY,
    SUPPORT_YY,
)
from tdbsim.errors import InputError
from tdbsim.machine import TouchdownBearing
from tdbsim.power_law import scaled_stiffness

if TYPE_CHECKING:
    from tdbsim.drop_model import DropModel

_LONGEST = 25e-6  # s
_SHORTEST = 1e-8  # s, with which a usual drop takes minutes; no real machine needs it
_DEPTH = 5e-6  # m, of an ordinary contact
_TURN = 0.75  # rad, phase of a ring's oscillation per step; beyond, the error grows with the fifth power and more
_WITH_SHAFT = 1.25  # rad, phase per step of ring and shaft on their contact: the first force is then right to 0.3 %
# rad, phase per step of the rings on balls, support and foundation; three times as much is unstable, and steps in free flight
# and of long coast-downs are each twice the usual one
_RINGS = 2.5
_SHORTER = 1.5  # rad, aimed at where that is exceeded
# greatest exponents of damping in a step: kicks backward in time amplify by as much, and errors with it
_STRUCK, _ROLLED, _YIELDED = 0.6, 2.8, 8.0
_OF = (
    "contact_stiffness and inner_ring_mass",
    "balls, support_stiffness, inner_ring_mass and support_mass",
    "contact_stiffness, contact_damping and inner_ring_mass",
    "ball_damping, inner_ring_mass and support_mass",
    "support_damping and support_mass",
    "foundation_mode",
)


def usual_step(model: DropModel) -> float:
    """Return the step, s, with which a drop is accurate to some nanometres at its first contacts.

    It depends on the fastest motions that the splitting does not integrate exactly.  Mostly that is the oscillation of an inner
    ring on the stiffness of its contact with the shaft: a light ring needs short steps.  So do a shaft as light as the rings,
    nearly rigid balls, supports or foundations, and strong dampers: the step is then divided by an integer.

    Raises
    ------
    InputError
        If a drop could not be simulated in a reasonable time, which only wrong values cause.
    """
    ends = model.machine.touchdown_bearings
    stiffness = [_contact(bearing) for bearing in ends]
    fastest = 0.0
    for bearing, contact in zip(ends, stiffness, strict=True):
        fastest = max(fastest, math.sqrt(contact / bearing.inner_ring_mass))
    step = min(_LONGEST, _TURN / fastest)
    parts = 1
    for end, bearing in enumerate(ends):
        shape, row = model.arrays.at_end[end], model.arrays.end[end].tolist()
        turns = _turns(row, stiffness[end], bearing.contact_exponent, float(shape @ shape), step)
        parts = max(parts, math.ceil(max(turns)))
        if step < _SHORTEST * parts:
            raise InputError(
                f"touchdown_bearing '{bearing.name}': with its {_OF[turns.index(max(turns))]} a drop would need steps of"
                f" {step / parts:.2g} s and hours to compute; check these values and their units"
            )
    return step / parts


def _contact(bearing: TouchdownBearing) -> float:
    """Return the stiffness of an ordinary contact of shaft and ring, N/m."""
    exponent = bearing.contact_exponent
    return exponent * scaled_stiffness(bearing.contact_stiffness, exponent) * _DEPTH ** (exponent - 1)


def _turns(row: Sequence[float], contact: float, exponent: float, own: float, step: float) -> tuple[float, ...]:
    """Return into how many parts the step must be divided for each oscillation and damper of an end, in the order of `_OF`.

    `row` : columns of the end; `contact` : stiffness of shaft on ring, N/m; `own` : change of the shaft's velocity there per unit
    of impulse, 1/kg.
    """
    ring, outer, base = 1 / row[RING_MASS], 1 / row[SUPPORT_MASS], row[FOUNDATION_MOBILITY]
    force, light = contact * _DEPTH / exponent, own + ring
    # stiffness of the balls under that force, or by their preload
    balls = 1.5 * row[BALL_STIFFNESS] ** (2 / 3) * force ** (1 / 3)
    preloaded = 1.5 * row[BALL_STIFFNESS] * math.sqrt(max(-row[HALF_CLEARANCE], 0.0)) * row[BALL_COUNT] / 2
    middle, half = (row[SUPPORT_XX] + row[SUPPORT_YY]) / 2, (row[SUPPORT_XX] - row[SUPPORT_YY]) / 2
    support = middle + math.hypot(half, row[SUPPORT_XY])
    # sum of the squared natural frequencies of rings and foundation, an upper bound of the highest
    squares = max(balls, preloaded) * (ring + outer) + support * (outer + base) + row[FOUNDATION_STIFFNESS] * base
    swung = step * math.sqrt(squares)
    return (
        step * math.sqrt(contact * light) / _WITH_SHAFT,
        swung / (_RINGS if swung <= _RINGS else _SHORTER),
        step * 1.5 * row[CONTACT_DAMPING] * force * light / _STRUCK,
        step * row[BALL_DAMPING] * (ring + outer) / _ROLLED,
        step * row[SUPPORT_DAMPING] * (outer + base) / _YIELDED,
        step * row[FOUNDATION_DAMPING] * base / _YIELDED,
    )
