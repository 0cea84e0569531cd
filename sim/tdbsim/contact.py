"""Contact of rotor and inner ring: point of contact, and the normal force of Hunt and Crossley.

K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42
(1975) 440.  For the contact stiffness see `tdbsim.power_law`.
"""

from __future__ import annotations

import math

from tdbsim import hooks
from tdbsim.cache import called, inlined

_FAR = 0.4  # rad; with no lobe sharper than the rotor, the contact is nearer than this to the direction of displacement
_PLACES = 72  # in a quarter turn, which holds three of the narrowest lobes


@inlined
def elastic_force(depth, stiffness, power):  # type: ignore[no-untyped-def]
    """Return K depth^(1 + power), N; depth in m, not negative."""
    return stiffness * depth * math.exp(math.log(depth) * power) if depth > 0.0 else 0.0


@inlined
def normal_force(elastic, approach, damping):  # type: ignore[no-untyped-def]
    """Return the damped normal force, N, never tensile; `approach` is the rate of the depth, m/s, `damping` in s/m."""
    force = elastic * (1.0 + 1.5 * damping * approach)
    return force if force > 0.0 else 0.0


@inlined
def touch(ex, ey, gap):  # type: ignore[no-untyped-def]
    """Return normal (x, y) and depth of a round rotor, displaced by (ex, ey), in a round bore."""
    distance = math.sqrt(ex * ex + ey * ey)
    if distance == 0.0:
        return 1.0, 0.0, -gap
    return ex / distance, ey / distance, distance - gap


@called
def touch_shaped(ex, ey, gap, ring_angle, heat, p):  # type: ignore[no-untyped-def]
    """Return normal (x, y), depth and the depth's derivative by the ring's angle, for a bore that is not round.

    The rotor touches where distance cos(azimuth - direction) - gap(azimuth) is greatest, which is not the direction of its
    displacement.  With the normal taken there the force has a potential, and the contact conserves energy.
    """
    distance = math.sqrt(ex * ex + ey * ey)
    if distance < 1e-3 * gap:
        return 1.0, 0.0, distance - gap, 0.0
    direction = math.atan2(ey, ex)
    bore = distance, direction, gap, ring_angle, heat, p
    azimuth, depth, swing, lobed = _descended(direction, 0.25 * distance, *bore)
    if lobed or abs(azimuth - direction) > _FAR:
        other, deeper, other_swing, _ = _descended(_near_deepest(*bore), 0.0, *bore)
        if deeper > depth + 1e-12:
            azimuth, depth, swing = other, deeper, other_swing
    return math.cos(azimuth), math.sin(azimuth), depth, swing


@called
def _descended(azimuth, least, distance, direction, gap, ring_angle, heat, p):  # type: ignore[no-untyped-def]
    """Return the local maximum of the depth near an azimuth, by Newton steps: azimuth, depth, its derivative by the ring's angle.

    The curvature in a step is at least `least`; the last value is True where the true curvature was less on the way.
    """
    lobed = False
    for _ in range(12):
        _, slope, curvature = hooks.gap(azimuth, heat, p)
        _, turning_slope, turning_curvature = hooks.bore(azimuth - ring_angle, p)
        turned = azimuth - direction
        steepness = distance * math.cos(turned) + curvature + turning_curvature
        lobed = lobed or steepness < least
        steepness = max(steepness, least)
        if not steepness > 0.0:
            break
        step = (distance * math.sin(turned) + slope + turning_slope) / steepness
        azimuth -= step
        if abs(step) < 1e-10:
            break
    depth, swing = _depth(azimuth, distance, direction, gap, ring_angle, heat, p)
    return azimuth, depth, swing, lobed


@called
def _near_deepest(distance, direction, gap, ring_angle, heat, p):  # type: ignore[no-untyped-def]
    """Return the azimuth near which a rotor is deepest in a bore with lobes sharper than itself, by a search on a grid.

    The depth then has several local maxima, and Newton steps may end at any of them, or at a minimum.
    """
    azimuth, deepest = direction, -math.inf
    for k in range(-_PLACES, _PLACES + 1):  # a quarter turn to either side; no contact lies beyond
        there = direction + 0.5 * math.pi * k / _PLACES
        depth, _ = _depth(there, distance, direction, gap, ring_angle, heat, p)
        if depth > deepest:
            azimuth, deepest = there, depth
    return azimuth


@inlined
def _depth(azimuth, distance, direction, gap, ring_angle, heat, p):  # type: ignore[no-untyped-def]
    """Return the depth at an azimuth and its derivative by the ring's angle."""
    value, _, _ = hooks.gap(azimuth, heat, p)
    turning_value, turning_slope, _ = hooks.bore(azimuth - ring_angle, p)
    return distance * math.cos(azimuth - direction) - (gap + value + turning_value), turning_slope
