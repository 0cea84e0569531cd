"""Rest position of inner and outer ring under the weight of the inner ring before the first contact."""

from __future__ import annotations

import math

from tdbsim.cache import compiled
from tdbsim.columns import FOUNDATION_MOBILITY, FOUNDATION_STIFFNESS, GRAVITY, HALF_CLEARANCE, RING_ANGLE, RING_MASS
from tdbsim.rhs import balls_on_ring
from tdbsim.support import spring_force

_NUDGE = 1e-10  # m, difference step of derivatives
_LONGEST = 5e-6  # m, longest step
_STILL = 1e-15  # m; shorter steps are rounding


@compiled
def rest(m, end):  # type: ignore[no-untyped-def]
    """Return positions (x, y) of inner ring, outer ring and foundation, m, and whether they were found."""
    row = m.end[end]
    weight = row[RING_MASS] * m.spin[GRAVITY]
    if weight == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, True
    base = -weight / row[FOUNDATION_STIFFNESS] if row[FOUNDATION_MOBILITY] > 0.0 else 0.0

    # outer ring on its spring
    x, y = 0.0, 0.0
    found = False
    for _ in range(100):
        fx, fy = spring_force(m.end, m.effect, end, x, y)
        gx, gy = spring_force(m.end, m.effect, end, x + _NUDGE, y)
        hx, hy = spring_force(m.end, m.effect, end, x, y + _NUDGE)
        dx, dy = _newton(fx, fy - weight, gx - fx, gy - fy, hx - fx, hy - fy)
        x += dx
        y += dy
        if abs(dx) + abs(dy) < 1e-13:
            found = True
            break
    if not found:
        x, y, found = _sagged(m, end, weight)

    # inner ring on the balls: the minimum of a convex potential, by damped Newton steps that do not pass the minimum along their
    # line by much
    u, v = 0.0, -(row[HALF_CLEARANCE] + 2e-5)
    fx, fy = balls_on_ring(m, end, u, v, row[RING_ANGLE])
    seated = False
    du, dv = 0.0, 0.0
    for _ in range(500):
        if math.hypot(fx, fy - weight) < 1e-9 * weight:
            seated = True
            break
        gx, gy = balls_on_ring(m, end, u + _NUDGE, v, row[RING_ANGLE])
        hx, hy = balls_on_ring(m, end, u, v + _NUDGE, row[RING_ANGLE])
        du, dv = _newton(fx, fy - weight, gx - fx, gy - fy, hx - fx, hy - fy)
        share = min(1.0, _LONGEST / math.hypot(du, dv))
        descent = fx * du + (fy - weight) * dv
        for _ in range(60):
            kx, ky = balls_on_ring(m, end, u + share * du, v + share * dv, row[RING_ANGLE])
            if kx * du + (ky - weight) * dv >= -0.5 * abs(descent):
                break
            share *= 0.5
        u += share * du
        v += share * dv
        fx, fy = kx, ky
    if not seated:  # a light ring between heavily loaded balls: its weight is below the rounding of their loads
        seated = math.hypot(du, dv) < _STILL
    return x + u, y + v + base, x, y + base, 0.0, base, found and seated


@compiled
def _sagged(m, end, weight):  # type: ignore[no-untyped-def]
    """Return the rest position of the outer ring on its spring, and whether it was found, where plain Newton steps fail.

    They fail where a spring that is soft within its play meets its seat.  Here steps are limited in length and do not pass the
    minimum along their line by much.
    """
    x, y = 0.0, 0.0
    fx, fy = spring_force(m.end, m.effect, end, x, y)
    for _ in range(1000):
        if math.hypot(fx, fy - weight) < 1e-9 * weight:
            return x, y, True
        gx, gy = spring_force(m.end, m.effect, end, x + _NUDGE, y)
        hx, hy = spring_force(m.end, m.effect, end, x, y + _NUDGE)
        dx, dy = _newton(fx, fy - weight, gx - fx, gy - fy, hx - fx, hy - fy)
        descent = fx * dx + (fy - weight) * dy
        length = math.hypot(dx, dy)
        if length < _STILL:
            return x, y, True
        share = min(1.0, _LONGEST / length)
        if not descent > 0.0:  # the stiffness is not positive definite: step along the force
            dx, dy = fx, fy - weight
            descent = dx * dx + dy * dy
            share = _LONGEST / math.sqrt(descent)
        kx, ky = fx, fy
        for _ in range(60):
            kx, ky = spring_force(m.end, m.effect, end, x + share * dx, y + share * dy)
            if kx * dx + (ky - weight) * dy >= -0.5 * descent:
                break
            share *= 0.5
        x += share * dx
        y += share * dy
        fx, fy = kx, ky
    return x, y, False


@compiled
def _newton(fx, fy, gx, gy, hx, hy):  # type: ignore[no-untyped-def]
    """Return the Newton step for two residuals f, from their changes g by a nudge in x and h by one in y."""
    # a single ball resists in one direction only: the small added stiffness prevents a step in the other
    a = gx / _NUDGE - 1.0
    b = hx / _NUDGE
    c = gy / _NUDGE
    d = hy / _NUDGE - 1.0
    determinant = a * d - b * c
    return -(d * fx - b * fy) / determinant, -(a * fy - c * fx) / determinant
