"""Equations of motion of a drop after the release, with all forces; for the state see `tdbsim.state_layout`."""

from __future__ import annotations

import math

from tdbsim import hooks, state_layout
from tdbsim.ball_bearing import cage_angle, ring_force, ring_force_wavy
from tdbsim.cache import compiled, inlined
from tdbsim.columns import (
    BALL_COUNT,
    BALL_DAMPING,
    BALL_STIFFNESS,
    CAGE_RATIO,
    CONTACT_DAMPING,
    CONTACT_POWER,
    CONTACT_STIFFNESS,
    COOLING_RATE,
    DECAY_RATE,
    FOUNDATION_DAMPING,
    FOUNDATION_MOBILITY,
    FOUNDATION_STIFFNESS,
    FRICTION,
    FRICTION_LOAD,
    FRICTION_POWER,
    GAP,
    GRAVITY,
    HALF_CLEARANCE,
    HAS_BOW,
    HAS_CIRCULATORY,
    HAS_HOLDING,
    HAS_SLIP_LAW,
    HAS_WINDAGE,
    INERTIA,
    JOURNAL_RADIUS,
    MAGNET_FX,
    MAGNET_FY,
    RING_ANGLE,
    RING_DRAG,
    RING_INERTIA,
    RING_MASS,
    ROTOR_ROW,
    SHAPE_REACH,
    SUPPORT_DAMPING,
    SUPPORT_MASS,
    WAVES_REACH,
)
from tdbsim.contact import elastic_force, normal_force, touch, touch_shaped
from tdbsim.friction import friction_force, load_share
from tdbsim.state_layout import (
    DRAGGED,
    EXTERNAL,
    HEAT,
    LEDGER,
    MODAL,
    ROLLED,
    RUBBED,
    STRUCK,
    WINDAGE,
    YIELDED,
)
from tdbsim.support import spring_force

REGULAR_SPIN = 1.0  # rad/s; the drag of an inner ring is proportional to its speed below it


@inlined
def touching(columns, effect, end, ex, ey, ring_angle, heat):  # type: ignore[no-untyped-def]
    """Return normal (x, y), depth and its derivative by the ring's angle, of the rotor displaced by (ex, ey) in the ring."""
    if columns[end, SHAPE_REACH] > 0.0:
        turned = ring_angle - columns[end, RING_ANGLE]
        return touch_shaped(ex, ey, columns[end, GAP], turned, heat, effect[end])
    nx, ny, depth = touch(ex, ey, columns[end, GAP])
    return nx, ny, depth, 0.0


@inlined
def balls_on_ring(m, end, ex, ey, ring_angle):  # type: ignore[no-untyped-def]
    """Return the force (x, y) of the balls on the inner ring, displaced by (ex, ey) relative to the outer ring, N."""
    row = m.end[end]
    cage = cage_angle(row, ring_angle)
    count = int(row[BALL_COUNT])
    if row[WAVES_REACH] > 0.0:
        return ring_force_wavy(
            ex, ey, count, row[BALL_STIFFNESS], row[HALF_CLEARANCE], cage, ring_angle, 2.0 * math.pi / count,
            m.ball_oversize[end], m.effect[end],
        )  # fmt: skip
    return ring_force(
        ex, ey, count, row[BALL_STIFFNESS], row[HALF_CLEARANCE], math.cos(cage), math.sin(cage),
        m.ball_cosine, m.ball_sine, m.ball_oversize, end,
    )  # fmt: skip


@inlined
def contact_forces(m, end, nx, ny, elastic, swing, vx, vy, omega, ring_speed):  # type: ignore[no-untyped-def]
    """Return force on the rotor (x, y), normal force, friction and slip; (vx, vy) is its velocity relative to the ring.

    Friction is positive counter-clockwise on the rotor, along (-ny, nx).
    """
    row = m.end[end]
    approach = vx * nx + vy * ny + swing * ring_speed
    normal = normal_force(elastic, approach, row[CONTACT_DAMPING])
    radius = row[JOURNAL_RADIUS]
    slip = omega * radius - ring_speed * (radius + row[GAP]) - vx * ny + vy * nx
    gripping = normal * load_share(normal, row[FRICTION_POWER], row[FRICTION_LOAD])
    rub = friction_force(gripping, slip, row[FRICTION], row[HAS_SLIP_LAW], m.effect, end)
    return -normal * nx - rub * ny, -normal * ny + rub * nx, normal, rub, slip


@inlined
def _ring_drag_torque(row, ring_speed):  # type: ignore[no-untyped-def]
    """Return the drag torque on an inner ring, N m, opposite to its speed."""
    return -row[RING_DRAG] * ring_speed / math.sqrt(ring_speed * ring_speed + REGULAR_SPIN * REGULAR_SPIN)


@inlined
def windage_acceleration(spin, effect, omega):  # type: ignore[no-untyped-def]
    """Return the rotor's angular acceleration by drag, rad/s^2: -omega/tau plus that of effects."""
    result = -spin[DECAY_RATE] * omega
    if spin[HAS_WINDAGE] > 0.0:
        result += hooks.windage(omega, effect[ROTOR_ROW])
    return result


@compiled
def derivative(m, t, y, dy):  # type: ignore[no-untyped-def]
    """Fill `dy` with the derivative of the state `y` at `t` s after the release."""
    n = len(m.square)
    nq = state_layout.positions(n)
    ledger = state_layout.work(n)
    omega = y[state_layout.omega(n)]
    for k in range(nq):
        dy[k] = y[nq + k]
    for k in range(len(LEDGER)):
        dy[ledger + k] = 0.0

    # modes: springs, damping, weight
    external = 0.0
    modal = 0.0
    for k in range(n):
        va = y[nq + k]
        vb = y[nq + n + k]
        dy[nq + k] = -m.square[k] * y[k] - m.damping[k] * va
        dy[nq + n + k] = -m.square[k] * y[n + k] - m.damping[k] * vb + m.weight[k]
        modal += m.damping[k] * (va * va + vb * vb)
    dy[ledger + MODAL] = modal

    # ends
    torque = 0.0
    for end in range(2):
        row = m.end[end]
        i = state_layout.bodies(n, end)
        j = state_layout.ring_angle(n, end)
        x = 0.0
        yy = 0.0
        vx = 0.0
        vy = 0.0
        for k in range(n):
            shape = m.at_end[end, k]
            x += shape * y[k]
            yy += shape * y[n + k]
            vx += shape * y[nq + k]
            vy += shape * y[nq + n + k]
        ring_vx, ring_vy, support_vx, support_vy = y[nq + i], y[nq + i + 1], y[nq + i + 2], y[nq + i + 3]
        base_vx, base_vy = y[nq + i + 4], y[nq + i + 5]
        ring_speed = y[nq + j]

        nx, ny, depth, swing = touching(m.end, m.effect, end, x - y[i], yy - y[i + 1], y[j], y[ledger + HEAT + end])
        fx = 0.0
        fy = 0.0
        ring_torque = _ring_drag_torque(row, ring_speed)
        dy[ledger + DRAGGED] -= ring_torque * ring_speed
        if depth > 0.0:
            elastic = elastic_force(depth, row[CONTACT_STIFFNESS], row[CONTACT_POWER])
            vrx = vx - ring_vx
            vry = vy - ring_vy
            fx, fy, normal, rub, slip = contact_forces(m, end, nx, ny, elastic, swing, vrx, vry, omega, ring_speed)
            torque += rub * row[JOURNAL_RADIUS]
            ring_torque += -rub * (row[JOURNAL_RADIUS] + row[GAP]) - normal * swing
            dy[ledger + RUBBED + end] = -rub * slip
            dy[ledger + STRUCK + end] = (normal - elastic) * (vrx * nx + vry * ny + swing * ring_speed)
        dy[ledger + HEAT + end] = dy[ledger + RUBBED + end] - row[COOLING_RATE] * y[ledger + HEAT + end]

        ex = y[i] - y[i + 2]
        ey = y[i + 1] - y[i + 3]
        bx, by = balls_on_ring(m, end, ex, ey, y[j])
        external += (ex * by - ey * bx) * row[CAGE_RATIO] * ring_speed  # the cage carries loaded balls along
        dx = row[BALL_DAMPING] * (support_vx - ring_vx)
        dz = row[BALL_DAMPING] * (support_vy - ring_vy)
        sx, sy = spring_force(m.end, m.effect, end, y[i + 2] - y[i + 4], y[i + 3] - y[i + 5])
        cx = row[SUPPORT_DAMPING] * (base_vx - support_vx)
        cy = row[SUPPORT_DAMPING] * (base_vy - support_vy)
        dy[nq + i] = (bx + dx - fx) / row[RING_MASS]
        dy[nq + i + 1] = (by + dz - fy) / row[RING_MASS] - m.spin[GRAVITY]
        dy[nq + i + 2] = (sx + cx - bx - dx) / row[SUPPORT_MASS]
        dy[nq + i + 3] = (sy + cy - by - dz) / row[SUPPORT_MASS]
        mobility = row[FOUNDATION_MOBILITY]
        dy[nq + i + 4] = mobility * (
            -sx - cx - row[FOUNDATION_STIFFNESS] * y[i + 4] - row[FOUNDATION_DAMPING] * base_vx
        )
        dy[nq + i + 5] = mobility * (
            -sy - cy - row[FOUNDATION_STIFFNESS] * y[i + 5] - row[FOUNDATION_DAMPING] * base_vy
        )
        dy[nq + j] = ring_torque / row[RING_INERTIA]
        dy[ledger + ROLLED + end] = dx * (support_vx - ring_vx) + dz * (support_vy - ring_vy)
        dy[ledger + YIELDED + end] = (
            cx * (base_vx - support_vx)
            + cy * (base_vy - support_vy)
            + row[FOUNDATION_DAMPING] * (base_vx * base_vx + base_vy * base_vy)
        )
        for k in range(n):
            shape = m.at_end[end, k]
            dy[nq + k] += shape * fx
            dy[nq + n + k] += shape * fy

    # spin; the torque of windage follows the tilted shaft, that of the contacts does not
    struck = torque / m.spin[INERTIA]
    windage = windage_acceleration(m.spin, m.effect, omega)
    alpha = struck + windage
    dy[state_layout.omega(n)] = alpha
    dy[ledger + WINDAGE] = -m.spin[INERTIA] * windage * omega

    # unbalance, bow, gyroscopic coupling
    angle = y[state_layout.shaft_angle(n)]
    cosine = math.cos(angle)
    sine = math.sin(angle)
    for k in range(n):
        along = m.unbalance[0, k] * cosine - m.unbalance[1, k] * sine
        across = m.unbalance[0, k] * sine + m.unbalance[1, k] * cosine
        fa = omega * omega * along + alpha * across
        fb = omega * omega * across - alpha * along
        if m.spin[HAS_BOW] > 0.0:
            fa += m.square[k] * (m.bow[0, k] * cosine - m.bow[1, k] * sine)
            fb += m.square[k] * (m.bow[0, k] * sine + m.bow[1, k] * cosine)
        for i in range(n):
            g = m.gyro[k, i]
            dy[nq + k] -= g * omega * y[nq + n + i]
            dy[nq + n + k] += g * omega * y[nq + i]
            fa -= g * struck * y[n + i]
            fb += g * struck * y[i]
        if m.spin[HAS_CIRCULATORY] > 0.0:
            for i in range(n):
                fa -= m.circulatory[k, i] * y[n + i]
                fb += m.circulatory[k, i] * y[i]
        dy[nq + k] += fa
        dy[nq + n + k] += fb
        external += fa * y[nq + k] + fb * y[nq + n + k]

    if m.spin[HAS_HOLDING] > 0.0:
        share = hooks.holding(t, m.effect[ROTOR_ROW])
        if share != 0.0:
            external += _add_magnets(m, share, y, dy)
    dy[ledger + EXTERNAL] = external


@inlined
def _add_magnets(m, share, y, dy):  # type: ignore[no-untyped-def]
    """Add a share of the magnetic force at the release to the derivative `dy`; return its power, W."""
    n = len(m.square)
    nq = state_layout.positions(n)
    power = 0.0
    for j in range(len(m.magnet)):
        fx = share * m.magnet[j, MAGNET_FX]
        fy = share * m.magnet[j, MAGNET_FY]
        for k in range(n):
            shape = m.at_magnet[j, k]
            dy[nq + k] += shape * fx
            dy[nq + n + k] += shape * fy
            power += shape * (fx * y[nq + k] + fy * y[nq + n + k])
    return power
