"""Friction of rotor on inner ring: Coulomb friction against the slip, regularised at small slip.

The coefficient may fall with a small power of the load: hardly between metals (Amontons' law, exponent 0), with an exponent of
up to a third for elastic asperities or films (F. P. Bowden, D. Tabor, The Friction and Lubrication of Solids, Oxford 1950).
"""

from __future__ import annotations

import math

from tdbsim import hooks
from tdbsim.cache import inlined

# m/s; below it friction is proportional to the slip.  Small against the 10 to 50 m/s at the release, large enough that a ring
# at shaft speed does not reduce the step.
REGULAR_SLIP = 0.05


@inlined
def sliding_force(normal, slip, coefficient):  # type: ignore[no-untyped-def]
    """Return the tangential force on the rotor, N, positive counter-clockwise, at a coefficient of friction.

    `slip`, m/s, is the velocity of the rotor's surface relative to the ring's, positive counter-clockwise.
    """
    return -coefficient * normal * slip / math.sqrt(slip * slip + REGULAR_SLIP * REGULAR_SLIP)


@inlined
def load_share(normal, power, reference):  # type: ignore[no-untyped-def]
    """Return the ratio of the coefficient at a normal force to that at a reference: (normal / reference)^-power."""
    return math.exp(-power * math.log(normal / reference)) if power != 0.0 and normal > 0.0 else 1.0


@inlined
def friction_force(normal, slip, coefficient, variable, effect, end):  # type: ignore[no-untyped-def]
    """Return the same with the effects on the coefficient, if any; `effect` : their coefficients."""
    if variable > 0.0:
        coefficient += hooks.friction(slip, effect[end])
    return sliding_force(normal, slip, coefficient)
