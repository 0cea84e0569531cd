"""Friction of rotor on inner ring: against the slip, of sliding strength beyond a small slip, smooth through zero.

The coefficient may fall with a small power of the load: between metals it hardly does (Amontons' law, exponent 0), between a
metal and elastic asperities or films it falls with up to a third (F. P. Bowden, D. Tabor, The Friction and Lubrication of
Solids, Oxford 1950).
"""

from __future__ import annotations

import math

from tdbsim import hooks
from tdbsim.cache import inlined

# m/s; below it friction grows in proportion to the slip.  Small against the 10 to 50 m/s at release, large enough that
# a ring at shaft speed makes no step shrink.
REGULAR_SLIP = 0.05


@inlined
def sliding_force(normal, slip, coefficient):  # type: ignore[no-untyped-def]
    """Return the tangential force on the rotor, N, positive counter-clockwise, at a coefficient of friction.

    `slip` in m/s is that of the rotor's surface over the ring's, positive counter-clockwise.
    """
    return -coefficient * normal * slip / math.sqrt(slip * slip + REGULAR_SLIP * REGULAR_SLIP)


@inlined
def load_share(normal, power, reference):  # type: ignore[no-untyped-def]
    """Return the coefficient at a normal force as a share of that at a reference: (normal / reference)^-power."""
    return math.exp(-power * math.log(normal / reference)) if power != 0.0 and normal > 0.0 else 1.0


@inlined
def friction_force(normal, slip, coefficient, variable, effect, end):  # type: ignore[no-untyped-def]
    """Return the same with the effects on the coefficient, where there are any: their numbers, and the end."""
    if variable > 0.0:
        coefficient += hooks.friction(slip, effect[end])
    return sliding_force(normal, slip, coefficient)
