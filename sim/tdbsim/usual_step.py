"""How long the steps of the splitting may be on a machine."""

from __future__ import annotations

import math

from tdbsim.machine import Machine
from tdbsim.power_law import scaled_stiffness

_LONGEST = 25e-6  # s
_DEPTH = 5e-6  # m, of an ordinary contact
_TURN = 0.75  # rad, that a ring may swing in a step; beyond, the error grows as the fifth power and more


def usual_step(machine: Machine) -> float:
    """Return the step, s, at which a drop is right to some nanometres at its first contacts.

    It goes by the fastest motion that the splitting does not follow exactly, the swing of an inner ring on the stiffness of
    its contact with the shaft: a light ring asks for short steps.
    """
    fastest = 0.0
    for bearing in machine.touchdown_bearings:
        exponent = bearing.contact_exponent
        stiffness = exponent * scaled_stiffness(bearing.contact_stiffness, exponent) * _DEPTH ** (exponent - 1)
        fastest = max(fastest, math.sqrt(stiffness / bearing.inner_ring_mass))
    return min(_LONGEST, _TURN / fastest)
