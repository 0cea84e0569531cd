"""Fast integration: a splitting of order 4, six force evaluations a step, in steps of three lengths.

Between the kicks the rotor's modes, damped, swing exactly and everything else drifts; in a kick positions stand still
and velocities change by all forces.  In a kick the contact's normal velocity obeys a linear equation, since the
Hunt-Crossley force is linear in it, and is advanced exactly; the dampers' too.  So the bending and attachment modes,
however high, and the speed, however it changes, cost no small steps; what bounds them is the inner ring between contact
and balls.

A step through which a contact begins or ends loses its order, since the force bends there: it is taken anew in four.
While neither end touches, a step is twice as long.

S. Blanes, P. C. Moan, Practical symplectic partitioned Runge-Kutta and Runge-Kutta-Nystrom methods, J. Comp. Appl. Math.
142 (2002) 313, table 2, method S6 of order 4.
"""

from __future__ import annotations

import math

import numpy as np

from tdbsim import hooks
from tdbsim.ball_bearing import ball_load
from tdbsim.cache import reassociated
from tdbsim.columns import (
    BALL_COUNT,
    BALL_DAMPING,
    BALL_STIFFNESS,
    CAGE_ANGLE,
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
    HAS_SHAPE,
    HAS_SLIP_LAW,
    HAS_SPRING,
    HAS_WAVES,
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
    SUPPORT_DAMPING,
    SUPPORT_MASS,
    SUPPORT_XX,
    SUPPORT_XY,
    SUPPORT_YY,
)
from tdbsim.contact import elastic_force, touch, touch_shaped
from tdbsim.friction import load_share
from tdbsim.kick import (
    DRIFT,
    KICK,
    after_drag,
    damp,
    damper_table,
    mean_press,
    rotated,
    slide,
    slide_by_law,
    swing_table,
)
from tdbsim.rhs import (
    DRAGGED,
    EXTERNAL,
    HEAT,
    MODAL,
    ROLLED,
    RUBBED,
    STRUCK,
    WINDAGE,
    YIELDED,
)
from tdbsim.support import linear_spring

SHORT, USUAL, LONG = range(3)  # steps: where a contact begins or ends; usual; in free flight
PARTS = (1, 4, 8)  # their lengths, in parts
_WHOLE = PARTS[USUAL]
FLIGHT_STEP = 50e-6  # s; no step in free flight is doubled beyond
START = (-1.0, 0.0)  # pace of a first call


@reassociated
def integrate(m, y, t, step, times, out, peak, pace):  # type: ignore[no-untyped-def]
    """Advance a state through instants.

    Parameters
    ----------
    m : Arrays
        The model.
    y : (size,) array
        State at `t`; at the last instant on return.
    t, step : float
        Time, s, and the greatest usual step.
    times : (k,) array
        Rising instants, the first not before `t`.
    out : (k, size) array
        Filled with the states at them.
    peak : (2,) array
        Raised to the greatest normal forces, N.
    pace : (2,) array
        `START`, or what a call before left there, so that two calls go the same way as one: the length of the usual step,
        s, and whether both ends were free (1) or not (0) at `t`.

    Returns
    -------
    float
        Time reached; it falls short where the state ceased to be finite.
    """
    n = len(m.square)
    nq = 2 * n + 15
    ledger = 2 * nq
    square, gyro, weight, at_end, unbalance = m.square, m.gyro, m.weight, m.at_end, m.unbalance
    circulatory = m.circulatory
    columns, effect, spin_columns = m.end, m.effect, m.spin
    ball_cosine, ball_sine, ball_oversize = m.ball_cosine, m.ball_sine, m.ball_oversize
    swing_tables = np.zeros((len(PARTS), 4, 4, 2 * n))
    damper_tables = np.zeros((len(PARTS), 3, 2, 5))
    tabled, aloft = pace[0], pace[1] > 0.0
    filled = np.zeros(len(PARTS), np.bool_)
    # the state in pieces, and as it was when a step began
    state, kept = y.copy(), y.copy()
    q, v = state[: 2 * n], state[nq : nq + 2 * n]
    place, angle = state[2 * n : 2 * n + 12], state[2 * n + 12 : nq]
    speed, spin = state[nq + 2 * n : nq + 2 * n + 12], state[nq + 2 * n + 12 : ledger]
    work = state[ledger:]
    pressed = np.zeros(2)
    push, half, turned_a, turned_b = np.zeros(2 * n), np.zeros(2 * n), np.zeros(n), np.zeros(n)
    losses = np.concatenate((m.damping, m.damping))
    impulse_x, impulse_y = np.zeros(2), np.zeros(2)
    speed_x, speed_y, place_x, place_y = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    cage_cosine, cage_sine = np.zeros(2), np.zeros(2)
    own, both = np.zeros(2), 0.0
    for k in range(n):
        own[0] += at_end[0, k] * at_end[0, k]
        own[1] += at_end[1, k] * at_end[1, k]
        both += at_end[0, k] * at_end[1, k]
    inertia, gravity = spin_columns[INERTIA], spin_columns[GRAVITY]
    # reciprocals, since divisions are slow
    ring_masses, support_masses = 1.0 / columns[:, RING_MASS], 1.0 / columns[:, SUPPORT_MASS]
    ring_inertias = 1.0 / columns[:, RING_INERTIA]
    turnings = columns[:, JOURNAL_RADIUS] / inertia
    slides = 1.0 / (
        own
        + ring_masses
        + columns[:, JOURNAL_RADIUS] * turnings
        + (columns[:, JOURNAL_RADIUS] + columns[:, GAP]) ** 2 * ring_inertias
    )
    lights = 1.0 / slides
    counts = np.zeros(2, np.int64)
    free = np.zeros(2)  # a ring nearer to the outer ring's middle than this touches no ball
    for end in range(2):
        counts[end] = int(columns[end, BALL_COUNT])
        free[end] = max(0.0, columns[end, HALF_CLEARANCE] - np.max(ball_oversize[end]))

    for row in range(len(times)):
        span = times[row] - t
        count = math.ceil(span / step - 1e-9) if span > 0.0 else 0
        usual = span / count if count > 0 else tabled
        if abs(usual - tabled) > 1e-12 * step:
            tabled = usual
            filled[:] = False
        left = _WHOLE * count  # of the way to this instant, in parts of a step
        shorts = 0
        while left > 0:
            size = USUAL
            if shorts > 0:
                size = SHORT
            elif aloft and left >= PARTS[LONG] and usual * PARTS[LONG] < _WHOLE * (1 + 1e-9) * FLIGHT_STEP:
                size = LONG
            h = usual * PARTS[size] / _WHOLE
            swings, dampers = swing_tables[size], damper_tables[size]
            if not filled[size]:
                swing_table(m, tabled * PARTS[size] / _WHOLE, swings)
                damper_table(m, tabled * PARTS[size] / _WHOLE, dampers)
                filled[size] = True
            now = times[row] - usual * left / _WHOLE
            kept[:] = state
            pressed[0], pressed[1] = 0.0, 0.0
            begun, met = 0, False  # who touches at the first kick; whether that changed
            cosine, sine = math.cos(angle[0]), math.sin(angle[0])
            for end in range(2):
                cage = columns[end, CAGE_RATIO] * (angle[1 + end] - columns[end, RING_ANGLE])
                cage += columns[end, CAGE_ANGLE]
                cage_cosine[end], cage_sine[end] = math.cos(cage), math.sin(cage)
            for stage in range(7):
                # drift
                s = min(stage, 6 - stage)
                tau = DRIFT[s] * h
                now += tau
                for k in range(2 * n):
                    before, rate = q[k], v[k]
                    q[k] = swings[s, 0, k] * before + swings[s, 1, k] * rate
                    v[k] = swings[s, 2, k] * before + swings[s, 3, k] * rate
                if stage == 3:
                    lost = 0.0
                    for k in range(2 * n):
                        lost += losses[k] * v[k] * v[k]
                    work[MODAL] += h * lost
                for k in range(12):
                    place[k] += tau * speed[k]
                for k in range(3):
                    angle[k] += tau * spin[k]
                cosine, sine = rotated(cosine, sine, tau * spin[0])
                for end in range(2):
                    turn = tau * columns[end, CAGE_RATIO] * spin[1 + end]
                    cage_cosine[end], cage_sine[end] = rotated(cage_cosine[end], cage_sine[end], turn)
                if stage == 6:
                    break

                # kick: places and velocities of the rotor at its ends
                s = min(stage, 5 - stage)
                tau = KICK[s] * h
                x0, y0, u0, v0, x1, y1, u1, v1 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for k in range(n):
                    first, second = at_end[0, k], at_end[1, k]
                    x0 += first * q[k]
                    y0 += first * q[n + k]
                    u0 += first * v[k]
                    v0 += first * v[n + k]
                    x1 += second * q[k]
                    y1 += second * q[n + k]
                    u1 += second * v[k]
                    v1 += second * v[n + k]
                place_x[0], place_y[0], place_x[1], place_y[1] = x0, y0, x1, y1
                speed_x[0], speed_y[0], speed_x[1], speed_y[1] = u0, v0, u1, v1

                touched = 0
                struck = 0.0  # change of the shaft's speed by the contacts
                for turn in range(2):
                    end = turn if stage < 3 else 1 - turn  # forth and back, so that the step stays symmetric
                    i = 6 * end
                    ring_mass, support_mass = ring_masses[end], support_masses[end]
                    mobility, ring_inertia = columns[end, FOUNDATION_MOBILITY], ring_inertias[end]
                    gap = columns[end, GAP]
                    # no arrays go into functions here but for effects: each would be counted, at every call
                    ex, ey = place_x[end] - place[i], place_y[end] - place[i + 1]
                    nx, ny, depth, swing = 0.0, 0.0, -1.0, 0.0
                    if columns[end, HAS_SHAPE] > 0.0:
                        turned = angle[1 + end] - columns[end, RING_ANGLE]
                        nx, ny, depth, swing = touch_shaped(ex, ey, gap, turned, work[HEAT + end], effect[end])
                    elif ex * ex + ey * ey > gap * gap:
                        nx, ny, depth = touch(ex, ey, gap)
                    ex, ey = place[i] - place[i + 2], place[i + 1] - place[i + 3]
                    bx, by = 0.0, 0.0
                    wavy = columns[end, HAS_WAVES] > 0.0
                    if wavy or ex * ex + ey * ey > free[end] * free[end]:
                        along = ex * cage_cosine[end] + ey * cage_sine[end]
                        across = ey * cage_cosine[end] - ex * cage_sine[end]
                        ball_stiffness, half_clearance = columns[end, BALL_STIFFNESS], columns[end, HALF_CLEARANCE]
                        push_along, push_across = 0.0, 0.0
                        if wavy:
                            spacing, turned = 2.0 * math.pi / counts[end], angle[1 + end]
                            cage = columns[end, CAGE_ANGLE] + columns[end, CAGE_RATIO] * (
                                turned - columns[end, RING_ANGLE]
                            )
                            for j in range(counts[end]):
                                press = along * ball_cosine[end, j] + across * ball_sine[end, j] - half_clearance
                                press += hooks.ball(cage + j * spacing, turned, effect[end])
                                load = ball_load(press + ball_oversize[end, j], ball_stiffness)
                                push_along -= load * ball_cosine[end, j]
                                push_across -= load * ball_sine[end, j]
                        else:
                            for j in range(counts[end]):
                                press = along * ball_cosine[end, j] + across * ball_sine[end, j] - half_clearance
                                load = ball_load(press + ball_oversize[end, j], ball_stiffness)
                                push_along -= load * ball_cosine[end, j]
                                push_across -= load * ball_sine[end, j]
                        bx = push_along * cage_cosine[end] - push_across * cage_sine[end]
                        by = push_along * cage_sine[end] + push_across * cage_cosine[end]
                    turn_rate = columns[end, CAGE_RATIO] * spin[1 + end]
                    work[EXTERNAL] += tau * (ex * by - ey * bx) * turn_rate  # the cage turns loaded balls along
                    ux, uy = place[i + 2] - place[i + 4], place[i + 3] - place[i + 5]
                    sx, sy = linear_spring(
                        ux, uy, columns[end, SUPPORT_XX], columns[end, SUPPORT_XY], columns[end, SUPPORT_YY]
                    )
                    if columns[end, HAS_SPRING] > 0.0:
                        more_x, more_y = hooks.support(ux, uy, effect[end])
                        sx += more_x
                        sy += more_y
                    d0, d1, d2 = dampers[s, end, 0], dampers[s, end, 1], dampers[s, end, 2]
                    d3, d4 = dampers[s, end, 3], dampers[s, end, 4]
                    rvx, svx, fvx = damp(speed[i], speed[i + 2], speed[i + 4], d0, d1, d2, d3, d4)
                    rvy, svy, fvy = damp(speed[i + 1], speed[i + 3], speed[i + 5], d0, d1, d2, d3, d4)
                    roll_x, roll_y, yield_x, yield_y = rvx - svx, rvy - svy, svx - fvx, svy - fvy

                    jx, jy, rubbed = 0.0, 0.0, 0.0
                    ring_spin = spin[1 + end]
                    if depth > 0.0:
                        touched += 1 + end
                        elastic = elastic_force(depth, columns[end, CONTACT_STIFFNESS], columns[end, CONTACT_POWER])
                        vx, vy = speed_x[end] - rvx, speed_y[end] - rvy
                        approach = vx * nx + vy * ny + swing * ring_spin
                        radius = columns[end, JOURNAL_RADIUS]
                        slip = spin[0] * radius - ring_spin * (radius + gap) - vx * ny + vy * nx
                        pull_n = -(bx * nx + by * ny) * ring_mass
                        pull_t = (bx * ny - by * nx) * ring_mass
                        light_n = own[end] + ring_mass + swing * swing * ring_inertia
                        light_t = lights[end]
                        mean = mean_press(elastic, approach, pull_n, light_n, 1.5 * columns[end, CONTACT_DAMPING], tau)
                        pressed[end] = max(pressed[end], mean)
                        coefficient = columns[end, FRICTION]
                        grip = mean * light_t
                        grip *= load_share(mean, columns[end, FRICTION_POWER], columns[end, FRICTION_LOAD])
                        if columns[end, HAS_SLIP_LAW] > 0.0:
                            changed = slide_by_law(slip, pull_t, grip, tau, coefficient, effect[end])
                        else:
                            changed = slide(slip, pull_t, grip, tau, coefficient)
                        rub = (changed - pull_t * tau) * slides[end]
                        press = mean * tau
                        jx, jy = -press * nx - rub * ny, -press * ny + rub * nx
                        middle = approach + 0.5 * (pull_n * tau - light_n * press)
                        work[STRUCK + end] += (press - elastic * tau) * middle
                        rubbed = -rub * (slip + 0.5 * changed)
                        work[RUBBED + end] += rubbed
                        gain = rub * turnings[end]
                        struck += gain
                        spin[0] += gain
                        ring_spin -= (rub * (radius + gap) + press * swing) * ring_inertia
                        speed_x[1 - end] += both * jx
                        speed_y[1 - end] += both * jy
                    work[HEAT + end] += rubbed - tau * columns[end, COOLING_RATE] * work[HEAT + end]
                    impulse_x[end], impulse_y[end] = jx, jy

                    rvx += (tau * bx - jx) * ring_mass
                    rvy += (tau * by - jy) * ring_mass - tau * gravity
                    svx += tau * (sx - bx) * support_mass
                    svy += tau * (sy - by) * support_mass
                    fvx -= tau * mobility * (sx + columns[end, FOUNDATION_STIFFNESS] * place[i + 4])
                    fvy -= tau * mobility * (sy + columns[end, FOUNDATION_STIFFNESS] * place[i + 5])
                    roll_x, roll_y = 0.5 * (roll_x + rvx - svx), 0.5 * (roll_y + rvy - svy)
                    yield_x, yield_y = 0.5 * (yield_x + svx - fvx), 0.5 * (yield_y + svy - fvy)
                    work[ROLLED + end] += tau * columns[end, BALL_DAMPING] * (roll_x * roll_x + roll_y * roll_y)
                    work[YIELDED + end] += tau * (
                        columns[end, SUPPORT_DAMPING] * (yield_x * yield_x + yield_y * yield_y)
                        + columns[end, FOUNDATION_DAMPING] * (fvx * fvx + fvy * fvy)
                    )
                    speed[i], speed[i + 2], speed[i + 4] = damp(rvx, svx, fvx, d0, d1, d2, d3, d4)
                    speed[i + 1], speed[i + 3], speed[i + 5] = damp(rvy, svy, fvy, d0, d1, d2, d3, d4)
                    slowed = after_drag(ring_spin, columns[end, RING_DRAG] * ring_inertia, tau)
                    work[DRAGGED] += 0.5 * (ring_spin * ring_spin - slowed * slowed) * columns[end, RING_INERTIA]
                    spin[1 + end] = slowed

                if stage == 0:
                    begun = touched
                elif touched != begun:
                    met = True
                    if size != SHORT:
                        break

                # the rotor: impulses, weight, unbalance, effects; gyroscopics between their halves
                omega = spin[0]
                slower = -spin_columns[DECAY_RATE] * omega
                if spin_columns[HAS_WINDAGE] > 0.0:
                    slower += hooks.windage(omega, effect[ROTOR_ROW])
                middle = omega + 0.5 * tau * slower
                slower = -tau * spin_columns[DECAY_RATE] * middle
                if spin_columns[HAS_WINDAGE] > 0.0:
                    slower += tau * hooks.windage(middle, effect[ROTOR_ROW])
                spin[0] = omega + slower
                work[WINDAGE] -= inertia * slower * middle
                pull, gain = tau * middle * middle, struck + slower
                along, across = pull * cosine + gain * sine, pull * sine - gain * cosine
                for k in range(n):
                    push[k] = unbalance[0, k] * along - unbalance[1, k] * across
                    push[n + k] = unbalance[0, k] * across + unbalance[1, k] * along
                if spin_columns[HAS_BOW] > 0.0:
                    for k in range(n):
                        push[k] += tau * square[k] * (m.bow[0, k] * cosine - m.bow[1, k] * sine)
                        push[n + k] += tau * square[k] * (m.bow[0, k] * sine + m.bow[1, k] * cosine)
                if spin_columns[HAS_CIRCULATORY] > 0.0:
                    for k in range(n):
                        total_a, total_b = 0.0, 0.0
                        for j in range(n):
                            total_a += circulatory[k, j] * q[j]
                            total_b += circulatory[k, j] * q[n + j]
                        push[k] -= tau * total_b
                        push[n + k] += tau * total_a
                if spin_columns[HAS_HOLDING] > 0.0:
                    share = tau * hooks.holding(now, effect[ROTOR_ROW])
                    for j in range(len(m.magnet)):
                        for k in range(n):
                            push[k] += share * m.at_magnet[j, k] * m.magnet[j, MAGNET_FX]
                            push[n + k] += share * m.at_magnet[j, k] * m.magnet[j, MAGNET_FY]
                supplied = 0.0
                for k in range(n):
                    struck_a = at_end[0, k] * impulse_x[0] + at_end[1, k] * impulse_x[1]
                    struck_b = at_end[0, k] * impulse_y[0] + at_end[1, k] * impulse_y[1] + tau * weight[k]
                    supplied += push[k] * (v[k] + 0.5 * (struck_a + push[k]))
                    supplied += push[n + k] * (v[n + k] + 0.5 * (struck_b + push[n + k]))
                    push[k] = 0.5 * (push[k] + struck_a)
                    push[n + k] = 0.5 * (push[n + k] + struck_b)
                work[EXTERNAL] += supplied
                turn = tau * middle
                for k in range(2 * n):
                    half[k] = v[k] + push[k]
                for step_of_turn in range(2):
                    # one plane turns the other, in turns; in the step's second half the other way round
                    if (step_of_turn == 0) == (stage < 3):
                        for k in range(n):
                            turned_a[k] = turn * half[n + k] + struck * q[n + k]
                        for k in range(n):
                            total = 0.0
                            for j in range(n):
                                total += gyro[k, j] * turned_a[j]
                            half[k] -= total
                    else:
                        for k in range(n):
                            turned_b[k] = turn * half[k] + struck * q[k]
                        for k in range(n):
                            total = 0.0
                            for j in range(n):
                                total += gyro[k, j] * turned_b[j]
                            half[n + k] += total
                for k in range(2 * n):
                    v[k] = half[k] + push[k]
            if met and size != SHORT:
                state[:] = kept
                aloft = False
                if size == USUAL:
                    shorts = _WHOLE
                continue
            left -= PARTS[size]
            shorts = max(0, shorts - 1)
            aloft = touched == 0
            peak[0], peak[1] = max(peak[0], pressed[0]), max(peak[1], pressed[1])
        t = times[row]
        out[row] = state
        if not math.isfinite(q[0] + q[n]):
            return t - span
    if len(times) > 0:
        y[:] = out[len(times) - 1]
    pace[0], pace[1] = tabled, 1.0 if aloft else 0.0
    return t
