"""Contact of rotor and inner ring: where they touch, and the normal force of Hunt and Crossley.

K. H. Hunt, F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42
(1975) 440.  How stiff the contact is, says `tdbsim.power_law`.
"""

from __future__ import annotations

import math

from tdbsim import hooks
from tdbsim.cache import called, inlined

_FAR = 0.4  # rad; where no lobe is sharper than the rotor, it touches nearer to the direction of its displacement
_PLACES = 72  # in a quarter turn, which holds three of the narrowest lobes


@inlined
def elastic_force(depth, stiffness, power):  # type: ignore[no-untyped-def]
    """Return K depth^(1 + power), N; depth in m, not negative."""
    return stiffness * depth * math.exp(math.log(depth) * power) if depth > 0.0 else 0.0


@inlined
def normal_force(elastic, approach, damping):  # type: ignore[no-untyped-def]
    """Return the force with damping, never pulling, N; `approach` is the rate of the depth, m/s, `damping` in s/m."""
    force = elastic * (1.0 + 1.5 * damping * approach)
    return force if force > 0.0 else 0.0


@inlined
def touch(ex, ey, gap):  # type: ignore[no-untyped-def]
    """Return the normal (x, y) and the depth where a round rotor, off by (ex, ey), meets a round bore."""
    distance = math.sqrt(ex * ex + ey * ey)
    if distance == 0.0:
        return 1.0, 0.0, -gap
    return ex / distance, ey / distance, distance - gap


@called
def touch_shaped(ex, ey, gap, ring_angle, heat, p):  # type: ignore[no-untyped-def]
    """Return normal (x, y), depth and the depth's derivative by the ring's angle, for a bore that is not round.

    The rotor touches where distance cos(azimuth - direction) - gap(azimuth) is greatest, which is not in the direction
    of its displacement: with the normal taken there the force has a potential, and the contact conserves energy.
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
    """Return where steps by slopes lead from an azimuth: there the azimuth, the depth and its derivative by the ring's angle.

    Steps are as long as with the least steepness at most; the last value is True where the bore was less steep on the way.
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
    """Return near which azimuth a rotor goes deepest into a bore whose lobes are sharper than itself, sought all along.

    There the greatest depth is one of several, and steps that go by slopes end at any of them, or at the least.
    """
    azimuth, deepest = direction, -math.inf
    for k in range(-_PLACES, _PLACES + 1):  # a quarter turn to either side, beyond which no bore is met
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
