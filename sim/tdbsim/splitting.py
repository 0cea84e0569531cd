"""Fast integration: a splitting of order 4 with fixed steps, six force evaluations a step.

Between the kicks the rotor's modes, damped, swing exactly and everything else drifts; in a kick positions stand still
and velocities change by all forces.  In a kick the contact's normal velocity obeys a linear equation, since the
Hunt-Crossley force is linear in it, and is advanced exactly; the dampers' too.  So the bending and attachment modes,
however high, and the speed, however it changes, cost no small steps; what bounds them is the inner ring between contact
and balls.

S. Blanes, P. C. Moan, Practical symplectic partitioned Runge-Kutta and Runge-Kutta-Nystrom methods, J. Comp. Appl. Math.
142 (2002) 313, table 2, method S6 of order 4.
"""

from __future__ import annotations

import math

import numpy as np

from tdbsim import hooks
from tdbsim.cache import compiled, inlined
from tdbsim.columns import (
    BALL_COUNT,
    BALL_DAMPING,
    BALL_STIFFNESS,
    CAGE_ANGLE,
    CAGE_RATIO,
    CONTACT_DAMPING,
    CONTACT_STIFFNESS,
    COOLING_RATE,
    FOUNDATION_DAMPING,
    FOUNDATION_MOBILITY,
    FOUNDATION_STIFFNESS,
    FRICTION,
    GAP,
    GRAVITY,
    HALF_CLEARANCE,
    HAS_BOW,
    HAS_CIRCULATORY,
    HAS_HOLDING,
    HAS_SLIP_LAW,
    HAS_WAVES,
    INERTIA,
    JOURNAL_RADIUS,
    MAGNET_FX,
    MAGNET_FY,
    RING_ANGLE,
    RING_DRAG,
    RING_INERTIA,
    RING_MASS,
    ROTOR_ROW,
    SUPPORT_DAMPING,
    SUPPORT_MASS,
)
from tdbsim.contact import elastic_force
from tdbsim.friction import friction_force
from tdbsim.ball_bearing import ring_force
from tdbsim.rhs import (
    DRAGGED,
    EXTERNAL,
    HEAT,
    MODAL,
    REGULAR_SPIN,
    ROLLED,
    RUBBED,
    STRUCK,
    WINDAGE,
    YIELDED,
    balls_on_ring,
    positions,
    touching,
    windage_acceleration,
)
from tdbsim.support import spring_force

DRIFT = np.array([0.0792036964311957, 0.353172906049774, -0.0420650803577195, 0.0])
DRIFT[3] = 1 - 2 * DRIFT.sum()
KICK = np.array([0.209515106613362, -0.143851773179818, 0.0])
KICK[2] = 0.5 - KICK.sum()

_SMALL_SLIP = 1.0  # m/s; below it the friction law bends within a kick


@inlined
def _swing_table(m, h, table):  # type: ignore[no-untyped-def]
    """Fill (4 drifts, 4, n): how displacement and velocity of each damped mode follow from those before."""
    for s in range(4):
        t = DRIFT[s] * h
        for k in range(len(m.square)):
            w2 = m.square[k]
            half = 0.5 * m.damping[k]
            if w2 == 0.0:
                table[s, 0, k] = 1.0
                table[s, 1, k] = t
                table[s, 2, k] = 0.0
                table[s, 3, k] = 1.0
            else:
                w = math.sqrt(w2 - half * half)
                decay = math.exp(-half * t)
                c = math.cos(w * t)
                q = math.sin(w * t) / w
                table[s, 0, k] = decay * (c + half * q)
                table[s, 1, k] = decay * q
                table[s, 2, k] = -decay * w2 * q
                table[s, 3, k] = decay * (c - half * q)


@inlined
def _damper_table(m, h, table):  # type: ignore[no-untyped-def]
    """Fill (3 kicks, 2 ends, 5): parts of the relative velocities that the dampers take in half a kick."""
    for s in range(3):
        t = 0.5 * KICK[s] * h
        for end in range(2):
            row = m.end[end]
            ring = 1.0 / row[RING_MASS]
            support = 1.0 / row[SUPPORT_MASS]
            base = row[FOUNDATION_MOBILITY]
            taken = -math.expm1(-row[BALL_DAMPING] * (ring + support) * t)
            table[s, end, 0] = taken * ring / (ring + support)
            table[s, end, 1] = taken * support / (ring + support)
            taken = -math.expm1(-row[SUPPORT_DAMPING] * (support + base) * t)
            table[s, end, 2] = taken * support / (support + base)
            table[s, end, 3] = taken * base / (support + base)
            table[s, end, 4] = -math.expm1(-row[FOUNDATION_DAMPING] * base * t)


@inlined
def _damp(m, end, y, i, ledger, part):  # type: ignore[no-untyped-def]
    """Let the dampers of an end act; `i` is the place of its velocities in the state, `part` its row of the table."""
    row = m.end[end]
    for axis in range(2):
        ring = y[i + axis]
        support = y[i + 2 + axis]
        base = y[i + 4 + axis]
        slip = ring - support
        y[i + axis] = ring - part[0] * slip
        moved = support + part[1] * slip
        y[ledger + ROLLED + end] += 0.5 * (
            row[RING_MASS] * (ring * ring - y[i + axis] ** 2) + row[SUPPORT_MASS] * (support * support - moved * moved)
        )
        slip = moved - base
        y[i + 2 + axis] = moved - part[2] * slip
        if row[FOUNDATION_MOBILITY] > 0.0:
            pushed = base + part[3] * slip
            y[i + 4 + axis] = pushed * (1.0 - part[4])
            lost = (base * base - y[i + 4 + axis] ** 2) / row[FOUNDATION_MOBILITY]
        else:
            lost = 0.0
        y[ledger + YIELDED + end] += 0.5 * (row[SUPPORT_MASS] * (moved * moved - y[i + 2 + axis] ** 2) + lost)


@inlined
def _turned(c, s, angle):  # type: ignore[no-untyped-def]
    """Return cosine and sine of an angle increased by a small one."""
    if abs(angle) > 0.1:
        ca = math.cos(angle)
        sa = math.sin(angle)
    else:
        q = angle * angle
        ca = 1.0 - q * (0.5 - q * (1 / 24 - q * (1 / 720 - q * (1 / 40320))))
        sa = angle * (1.0 - q * (1 / 6 - q * (1 / 120 - q * (1 / 5040))))
    return c * ca - s * sa, s * ca + c * sa


@inlined
def _slide(slip, pull, grip, t, row, p):  # type: ignore[no-untyped-def]
    """Return the change of the slip in a kick: slip' = pull - grip mu(slip), grip a normal force over a mass."""
    change = 0.0
    k1 = pull + friction_force(grip, slip, row[FRICTION], row[HAS_SLIP_LAW], p)
    k2 = pull + friction_force(grip, slip + 0.5 * t * k1, row[FRICTION], row[HAS_SLIP_LAW], p)
    if abs(slip) > _SMALL_SLIP and row[HAS_SLIP_LAW] == 0.0:
        return t * k2
    k3 = pull + friction_force(grip, slip + 0.5 * t * k2, row[FRICTION], row[HAS_SLIP_LAW], p)
    k4 = pull + friction_force(grip, slip + t * k3, row[FRICTION], row[HAS_SLIP_LAW], p)
    change = t * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
    return change


@inlined
def _slowed(speed, drag, t):  # type: ignore[no-untyped-def]
    """Return the speed of a ring after its drag acted for t; `drag` in rad/s^2."""
    middle = speed / (1.0 + 0.5 * t * drag / math.sqrt(speed * speed + REGULAR_SPIN * REGULAR_SPIN))
    return speed / (1.0 + t * drag / math.sqrt(middle * middle + REGULAR_SPIN * REGULAR_SPIN)) if (
        drag * abs(t) > 0.1
    ) else speed - t * drag * middle / math.sqrt(middle * middle + REGULAR_SPIN * REGULAR_SPIN)


@compiled
def integrate(m, y, t, step, times, out, peak):  # type: ignore[no-untyped-def]
    """Advance `y` (in place) from `t` through `times` in equal steps of at most `step`, filling the rows of `out`.

    `peak` (2,) is raised to the greatest normal forces, N.  Returns the time reached, which falls short where the state
    ceased to be finite.
    """
    n = len(m.square)
    nq = positions(n)
    ledger = 2 * nq
    shaft = 2 * n + 12
    swing_table = np.zeros((4, 4, n))
    damper_table = np.zeros((3, 2, 5))
    tabled = -1.0
    fa = np.zeros(n)
    fb = np.zeros(n)
    wa = np.zeros(n)
    wb = np.zeros(n)
    impulse = np.zeros((2, 2))
    speed_at = np.zeros((2, 2))
    place_at = np.zeros((2, 2))
    compliance = np.zeros((2, 2))
    for k in range(n):
        compliance[0, 0] += m.at_end[0, k] ** 2
        compliance[0, 1] += m.at_end[0, k] * m.at_end[1, k]
        compliance[1, 1] += m.at_end[1, k] ** 2
    compliance[1, 0] = compliance[0, 1]
    cage = np.zeros((2, 2))
    inertia = m.spin[INERTIA]

    for row_out in range(len(times)):
        span = times[row_out] - t
        count = int(math.ceil(span / step - 1e-9)) if span > 0.0 else 0
        h = span / count if count > 0 else tabled
        if abs(h - tabled) > 1e-12 * step:
            _swing_table(m, h, swing_table)
            _damper_table(m, h, damper_table)
            tabled = h
        for one in range(count):
            now = t + one * h
            cosine = math.cos(y[shaft])
            sine = math.sin(y[shaft])
            for end in range(2):
                row = m.end[end]
                angle = row[CAGE_ANGLE] + row[CAGE_RATIO] * (y[shaft + 1 + end] - row[RING_ANGLE])
                cage[end, 0] = math.cos(angle)
                cage[end, 1] = math.sin(angle)
            for stage in range(7):
                # drift
                s = min(stage, 6 - stage)
                tau = DRIFT[s] * h
                now += tau
                before = 0.0
                for k in range(n):
                    q = y[k]
                    v = y[nq + k]
                    y[k] = swing_table[s, 0, k] * q + swing_table[s, 1, k] * v
                    y[nq + k] = swing_table[s, 2, k] * q + swing_table[s, 3, k] * v
                    q2 = y[n + k]
                    v2 = y[nq + n + k]
                    y[n + k] = swing_table[s, 0, k] * q2 + swing_table[s, 1, k] * v2
                    y[nq + n + k] = swing_table[s, 2, k] * q2 + swing_table[s, 3, k] * v2
                    before += (
                        m.square[k] * (q * q + q2 * q2 - y[k] ** 2 - y[n + k] ** 2)
                        + v * v
                        + v2 * v2
                        - y[nq + k] ** 2
                        - y[nq + n + k] ** 2
                    )
                y[ledger + MODAL] += 0.5 * before
                for k in range(2 * n, nq):
                    y[k] += tau * y[nq + k]
                cosine, sine = _turned(cosine, sine, tau * y[nq + shaft])
                for end in range(2):
                    turn = tau * m.end[end, CAGE_RATIO] * y[nq + shaft + 1 + end]
                    cage[end, 0], cage[end, 1] = _turned(cage[end, 0], cage[end, 1], turn)
                if stage == 6:
                    break

                # kick
                s = min(stage, 5 - stage)
                tau = KICK[s] * h
                x0 = 0.0
                y0 = 0.0
                u0 = 0.0
                v0 = 0.0
                x1 = 0.0
                y1 = 0.0
                u1 = 0.0
                v1 = 0.0
                for k in range(n):
                    first = m.at_end[0, k]
                    second = m.at_end[1, k]
                    x0 += first * y[k]
                    y0 += first * y[n + k]
                    u0 += first * y[nq + k]
                    v0 += first * y[nq + n + k]
                    x1 += second * y[k]
                    y1 += second * y[n + k]
                    u1 += second * y[nq + k]
                    v1 += second * y[nq + n + k]
                place_at[0, 0], place_at[0, 1], place_at[1, 0], place_at[1, 1] = x0, y0, x1, y1
                speed_at[0, 0], speed_at[0, 1], speed_at[1, 0], speed_at[1, 1] = u0, v0, u1, v1

                struck = 0.0  # change of the shaft's speed by the contacts
                for turn in range(2):
                    end = turn if stage < 3 else 1 - turn  # forth and back, so that the step stays symmetric
                    row = m.end[end]
                    i = 2 * n + 6 * end
                    spin = nq + shaft + 1 + end
                    ring_mass = 1.0 / row[RING_MASS]
                    nx, ny, depth, swing = touching(
                        m, end, place_at[end, 0] - y[i], place_at[end, 1] - y[i + 1], y[shaft + 1 + end],
                        y[ledger + HEAT + end],
                    )  # fmt: skip
                    if row[HAS_WAVES] > 0.0:
                        bx, by = balls_on_ring(m, end, y[i] - y[i + 2], y[i + 1] - y[i + 3], y[shaft + 1 + end])
                    else:
                        bx, by = ring_force(
                            y[i] - y[i + 2], y[i + 1] - y[i + 3], int(row[BALL_COUNT]), row[BALL_STIFFNESS],
                            row[HALF_CLEARANCE], cage[end, 0], cage[end, 1], m.ball_cosine[end], m.ball_sine[end],
                            m.ball_oversize[end],
                        )  # fmt: skip
                    sx, sy = spring_force(y[i + 2] - y[i + 4], y[i + 3] - y[i + 5], row, m.effect[end])
                    _damp(m, end, y, nq + i, ledger, damper_table[s, end])
                    jx = 0.0
                    jy = 0.0
                    rubbed = 0.0
                    if depth > 0.0:
                        elastic = elastic_force(depth, row[CONTACT_STIFFNESS])
                        vx = speed_at[end, 0] - y[nq + i]
                        vy = speed_at[end, 1] - y[nq + i + 1]
                        approach = vx * nx + vy * ny + swing * y[spin]
                        radius = row[JOURNAL_RADIUS]
                        slip = y[nq + shaft] * radius - y[spin] * (radius + row[GAP]) - vx * ny + vy * nx
                        pull_n = -(bx * nx + by * ny) * ring_mass
                        pull_t = (bx * ny - by * nx) * ring_mass
                        light = compliance[end, end] + ring_mass
                        light_n = light + swing * swing / row[RING_INERTIA]
                        light_t = (
                            light + radius * radius / inertia + (radius + row[GAP]) ** 2 / row[RING_INERTIA]
                        )
                        # approach' = pull_n - light_n elastic (1 + damping approach), exactly
                        damping = 1.5 * row[CONTACT_DAMPING]
                        rate = light_n * elastic * damping * tau
                        phi1 = 1.0 - rate / 2 * (1.0 - rate / 3 * (1.0 - rate / 4 * (1.0 - rate / 5 * (1.0 - rate / 6))))
                        phi2 = 0.5 * (1.0 - rate / 3 * (1.0 - rate / 4 * (1.0 - rate / 5 * (1.0 - rate / 6))))
                        if abs(rate) > 0.3:
                            phi1 = -math.expm1(-rate) / rate
                            phi2 = (1.0 - phi1) / rate
                        mean = elastic * (
                            1.0 + damping * (approach * phi1 + (pull_n - light_n * elastic) * tau * phi2)
                        )
                        if mean < 0.0:
                            mean = 0.0
                        peak[end] = max(peak[end], mean)
                        changed = _slide(slip, pull_t, mean * light_t, tau, row, m.effect[end])
                        rub = (changed - pull_t * tau) / light_t
                        press = mean * tau
                        jx = -press * nx - rub * ny
                        jy = -press * ny + rub * nx
                        changed_n = pull_n * tau - light_n * press
                        y[ledger + STRUCK + end] += (press - elastic * tau) * (approach + 0.5 * changed_n)
                        rubbed = -rub * (slip + 0.5 * changed)
                        y[ledger + RUBBED + end] += rubbed
                        gain = rub * radius / inertia
                        struck += gain
                        y[nq + shaft] += gain
                        y[spin] += (-rub * (radius + row[GAP]) - press * swing) / row[RING_INERTIA]
                        other = 1 - end
                        speed_at[other, 0] += compliance[0, 1] * jx
                        speed_at[other, 1] += compliance[0, 1] * jy
                    y[ledger + HEAT + end] += rubbed - tau * row[COOLING_RATE] * y[ledger + HEAT + end]
                    impulse[end, 0] = jx
                    impulse[end, 1] = jy
                    y[nq + i] += (tau * bx - jx) * ring_mass
                    y[nq + i + 1] += (tau * by - jy) * ring_mass - tau * m.spin[GRAVITY]
                    y[nq + i + 2] += tau * (sx - bx) / row[SUPPORT_MASS]
                    y[nq + i + 3] += tau * (sy - by) / row[SUPPORT_MASS]
                    if row[FOUNDATION_MOBILITY] > 0.0:
                        push = tau * row[FOUNDATION_MOBILITY]
                        y[nq + i + 4] += push * (-sx - row[FOUNDATION_STIFFNESS] * y[i + 4])
                        y[nq + i + 5] += push * (-sy - row[FOUNDATION_STIFFNESS] * y[i + 5])
                    _damp(m, end, y, nq + i, ledger, damper_table[s, end])
                    slowed = _slowed(y[spin], row[RING_DRAG] / row[RING_INERTIA], tau)
                    y[ledger + DRAGGED] += 0.5 * row[RING_INERTIA] * (y[spin] ** 2 - slowed * slowed)
                    y[spin] = slowed

                # the rotor: impulses, weight, unbalance, effects; gyroscopics between their halves
                omega = y[nq + shaft]
                middle = omega + 0.5 * tau * windage_acceleration(m, omega)
                lost = tau * windage_acceleration(m, middle)
                y[nq + shaft] = omega + lost
                y[ledger + WINDAGE] -= inertia * lost * middle
                share = 0.0
                if m.spin[HAS_HOLDING] > 0.0:
                    share = tau * hooks.holding(now, m.effect[ROTOR_ROW])
                square = tau * middle * middle
                gain = struck + lost
                for k in range(n):
                    along = m.unbalance[0, k] * cosine - m.unbalance[1, k] * sine
                    across = m.unbalance[0, k] * sine + m.unbalance[1, k] * cosine
                    fa[k] = square * along + gain * across
                    fb[k] = square * across - gain * along
                if m.spin[HAS_BOW] > 0.0:
                    for k in range(n):
                        fa[k] += tau * m.square[k] * (m.bow[0, k] * cosine - m.bow[1, k] * sine)
                        fb[k] += tau * m.square[k] * (m.bow[0, k] * sine + m.bow[1, k] * cosine)
                if m.spin[HAS_CIRCULATORY] > 0.0:
                    for k in range(n):
                        for j in range(n):
                            fa[k] -= tau * m.circulatory[k, j] * y[n + j]
                            fb[k] += tau * m.circulatory[k, j] * y[j]
                if share != 0.0:
                    for j in range(len(m.magnet)):
                        for k in range(n):
                            fa[k] += share * m.at_magnet[j, k] * m.magnet[j, MAGNET_FX]
                            fb[k] += share * m.at_magnet[j, k] * m.magnet[j, MAGNET_FY]
                work = 0.0
                for k in range(n):
                    pa = m.at_end[0, k] * impulse[0, 0] + m.at_end[1, k] * impulse[1, 0]
                    pb = m.at_end[0, k] * impulse[0, 1] + m.at_end[1, k] * impulse[1, 1] + tau * m.weight[k]
                    work += fa[k] * (y[nq + k] + 0.5 * (pa + fa[k])) + fb[k] * (y[nq + n + k] + 0.5 * (pb + fb[k]))
                    fa[k] = 0.5 * (fa[k] + pa)
                    fb[k] = 0.5 * (fb[k] + pb)
                    wa[k] = y[nq + k] + fa[k]
                    wb[k] = y[nq + n + k] + fb[k]
                turned = tau * middle
                for k in range(n):
                    total = 0.0
                    for j in range(n):
                        total += m.gyro[k, j] * (turned * wb[j] + struck * y[n + j])
                    wa[k] -= 0.5 * total
                for k in range(n):
                    total = 0.0
                    for j in range(n):
                        total += m.gyro[k, j] * (turned * wa[j] + struck * y[j])
                    wb[k] += total
                for k in range(n):
                    total = 0.0
                    for j in range(n):
                        total += m.gyro[k, j] * (turned * wb[j] + struck * y[n + j])
                    y[nq + k] = wa[k] - 0.5 * total + fa[k]
                    y[nq + n + k] = wb[k] + fb[k]
                y[ledger + EXTERNAL] += work
        t = times[row_out]
        for k in range(len(y)):
            out[row_out, k] = y[k]
        if not math.isfinite(y[0] + y[n]):
            return t - span
    return t
