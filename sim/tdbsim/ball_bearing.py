"""The ball bearing between inner and outer ring: balls as Hertz springs, and a cage that rolls with the ring.

Deep groove without axial load: ball j at azimuth beta_j is compressed by delta_j = e_x cos beta_j + e_y sin beta_j - c_d/2 +
its oversize + waviness, and carries Q_j = K delta_j^(3/2) where delta_j > 0 (T. A. Harris, Rolling Bearing Analysis).
"""

from __future__ import annotations

import math

from tdbsim import hooks
from tdbsim.cache import inlined, shared
from tdbsim.columns import BALL_COUNT, CAGE_ANGLE, CAGE_RATIO, HALF_CLEARANCE, RING_ANGLE, WAVES_REACH


@shared
def cage_angle(row, ring_angle):  # type: ignore[no-untyped-def]
    """Return the angle of the cage, rad, at `ring_angle` of the inner ring; `row` : columns of the end."""
    return row[CAGE_ANGLE] + row[CAGE_RATIO] * (ring_angle - row[RING_ANGLE])


@inlined
def ball_load(press, stiffness):  # type: ignore[no-untyped-def]
    """Return the load of a ball, N, compressed by `press`, m."""
    return stiffness * press * math.sqrt(press) if press > 0.0 else 0.0


@inlined
def ball_press(m, end, j, along, across, cage, ring_angle):  # type: ignore[no-untyped-def]
    """Return the compression of ball `j` of an end, m, negative where it is loose.

    (along, across) : displacement of the inner relative to the outer ring, in the cage's frame.
    """
    row = m.end[end]
    press = along * m.ball_cosine[end, j] + across * m.ball_sine[end, j] - row[HALF_CLEARANCE] + m.ball_oversize[end, j]
    if row[WAVES_REACH] > 0.0:
        press += hooks.ball(cage + j * (2.0 * math.pi / row[BALL_COUNT]), ring_angle, m.effect[end])
    return press


# the force kernels repeat the sum: with other rounding of the rings' rest position, fits end in other local minima
@inlined
def ring_force(ex, ey, count, stiffness, half_clearance, cos_cage, sin_cage, cosine, sine, oversize, end):  # type: ignore[no-untyped-def]
    """Return the force (x, y) of the balls on the inner ring, displaced by (ex, ey) relative to the outer one.

    `cosine`, `sine` : of the balls' azimuths in the cage's frame, into which the displacement is rotated once for all balls.
    """
    u = ex * cos_cage + ey * sin_cage
    v = ey * cos_cage - ex * sin_cage
    fu = 0.0
    fv = 0.0
    for j in range(count):
        press = u * cosine[end, j] + v * sine[end, j] - half_clearance + oversize[end, j]
        if press > 0.0:
            load = stiffness * press * math.sqrt(press)
            fu -= load * cosine[end, j]
            fv -= load * sine[end, j]
    return fu * cos_cage - fv * sin_cage, fu * sin_cage + fv * cos_cage


@inlined
def ring_force_wavy(ex, ey, count, stiffness, half_clearance, cage, ring, spacing, oversize, p):  # type: ignore[no-untyped-def]
    """Return the same with waviness of the raceways; `cage` and `ring` are angles, `spacing` is the angle between balls."""
    fx = 0.0
    fy = 0.0
    for j in range(count):
        azimuth = cage + j * spacing
        c = math.cos(azimuth)
        s = math.sin(azimuth)
        load = ball_load(ex * c + ey * s - half_clearance + oversize[j] + hooks.ball(azimuth, ring, p), stiffness)
        fx -= load * c
        fy -= load * s
    return fx, fy
