"""Power law of the contact of rotor and ring: force K depth^(10/9), or another exponent with the same force at 10 um.

The exponent 10/9 is that of two cylinders in line contact; edges and misalignment raise it (3/2 in a point contact).
"""

from __future__ import annotations

LINE_CONTACT = 10 / 9
REFERENCE_DEPTH = 10e-6  # m


def scaled_stiffness(stiffness: float, exponent: float) -> float:
    """Return K' of the force K' depth^exponent that equals K depth^(10/9) at the reference depth.

    Parameters
    ----------
    stiffness : float
        K, N/m^(10/9).
    exponent : float
    """
    return stiffness * REFERENCE_DEPTH ** (LINE_CONTACT - exponent)


def static_depth(load: float, stiffness: float, exponent: float) -> float:
    """Return the depth, m, at which the contact carries a load, N.

    Parameters
    ----------
    load : float
        N, not negative.
    stiffness : float
        K, N/m^(10/9).
    exponent : float
    """
    return float((load / scaled_stiffness(stiffness, exponent)) ** (1 / exponent))
