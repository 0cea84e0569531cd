"""Fast integration: a splitting method of order 4 with six force evaluations per step, in steps of three lengths.

In a drift the damped modes of the rotor oscillate exactly and everything else moves at constant velocity; in a kick positions are
fixed and velocities change by all forces.  The contact's normal velocity in a kick obeys a linear equation, since the
Hunt-Crossley force is linear in it, and is advanced exactly; so are the dampers.  High bending and attachment modes or changes of
speed therefore need no small steps; the step is limited by the oscillation of the inner ring between contact and balls.

Like quantities are stored in rows (`mode_rows`, `ring_rows`, `turning`) for vectorisation.  The cost is latency, not arithmetic:
displacement, depth, force, friction, the other end's friction and gyroscopic coupling each depend on the one before.

A step in which a contact begins or ends loses its order, since the force has a kink there: it is repeated in four.  While
neither end touches, a step is twice as long.

S. Blanes, P. C. Moan, Practical symplectic partitioned Runge-Kutta and Runge-Kutta-Nystrom methods, J. Comp. Appl. Math.
142 (2002) 313, table 2, method S6 of order 4.
"""

from __future__ import annotations

import math

import numpy as np

from tdbsim import hooks, state_layout
from tdbsim.ball_bearing import ball_load, cage_angle
from tdbsim.cache import reassociated
from tdbsim.columns import (
    BALL_COUNT,
    BALL_STIFFNESS,
    CAGE_RATIO,
    CONTACT_DAMPING,
    CONTACT_POWER,
    CONTACT_STIFFNESS,
    COOLING_RATE,
    DECAY_RATE,
    FRICTION,
    FRICTION_LOAD,
    FRICTION_POWER,
    GAP,
    HALF_CLEARANCE,
    HAS_BOW,
    HAS_CIRCULATORY,
    HAS_HOLDING,
    HAS_SLIP_LAW,
    HAS_SPRING,
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
    SUPPORT_XX,
    SUPPORT_XY,
    SUPPORT_YY,
    WAVES_REACH,
)
from tdbsim.contact import touch, touch_shaped
from tdbsim.friction import load_share
from tdbsim.kick import (
    DRIFT,
    KICK,
    after_drag,
    mean_press,
    slide,
    slide_by_law,
    swing_table,
)
from tdbsim.mode_rows import (
    LANES,
    MORE_X,
    MORE_Y,
    RATE_X,
    RATE_Y,
    SWING_STOP,
    TURN_X,
    TURN_Y,
    X,
    Y,
    copy_modes,
    drift,
    gyro_rows,
    mode_rows,
    push,
    store_modes,
    turn_plane,
)
from tdbsim.power_table import POWER_STOP, power, power_table
from tdbsim.ring_rows import (
    BALL_FORCE,
    BASE,
    DAMPER_STOP,
    IMPULSE,
    OUTER,
    RING,
    RING_RATE,
    SPRING_FORCE,
    copy_rings,
    damp_rings,
    damper_table,
    move_rings,
    push_rings,
    ring_rows,
    store_rings,
)
from tdbsim.state_layout import DRAGGED, EXTERNAL, HEAT, MODAL, RUBBED, STRUCK, WINDAGE
from tdbsim.support import linear_spring
from tdbsim.turning import (
    ANGLE,
    COSINES,
    SINES,
    SPIN,
    copy_turning,
    set_directions,
    store_turning,
    turn_on,
    turning_rows,
)

SHORT, USUAL, LONG = range(3)  # kinds of step: where a contact begins or ends; usual; in free flight
PARTS = (1, 4, 8)  # their lengths, in quarters of the usual step
_WHOLE = PARTS[USUAL]
FLIGHT_STEP = 50e-6  # s; steps in free flight are doubled up to this length
START = (-1.0, 0.0)  # pace of the first call


@reassociated
def integrate(m, y, t, step, times, out, peak, pace):  # type: ignore[no-untyped-def]
    """Advance a state through given instants.

    Parameters
    ----------
    m : Arrays
        The model.
    y : (size,) array
        State at `t`; at the last instant on return.
    t, step : float
        Time, s, and the greatest usual step.
    times : (k,) array
        Ascending instants, the first not before `t`.
    out : (k, size) array
        Filled with the states at them.
    peak : (2,) array
        Updated to the greatest normal forces, N.
    pace : (2,) array
        `START`, or as left by the previous call, so that two calls give the same as one: the usual step, s, and whether both
        ends were free (1) or not (0) at `t`.

    Returns
    -------
    float
        Time reached, short of the last instant where the state became non-finite.
    """
    n = len(m.square)
    ledger = state_layout.work(n)
    lanes = LANES * ((n + LANES - 1) // LANES)
    axes = min(lanes, LANES)  # eight, hidden from the compiler, which does not vectorise loops of known length
    square, circulatory = m.square, m.circulatory
    columns, effect, spin_columns = m.end, m.effect, m.spin
    swing_tables = np.zeros((len(PARTS), 4, SWING_STOP))
    damper_tables = np.zeros((len(PARTS), 3, DAMPER_STOP))
    tabled, aloft = pace[0], pace[1] > 0.0
    filled = np.zeros(len(PARTS), np.bool_)
    # the state in parts, and its copy at the start of a step
    modal, rings, turning, work = mode_rows(m, y), ring_rows(m, y), turning_rows(m, y), y[ledger:].copy()
    kept_modal, kept_rings, kept_turning, kept_work = modal.copy(), rings.copy(), turning.copy(), work.copy()
    gyro = gyro_rows(m.gyro, lanes)
    angle, spin = turning[ANGLE : ANGLE + 3], turning[SPIN : SPIN + 3]
    cosines, sines = turning[COSINES : COSINES + 3], turning[SINES : SINES + 3]
    pressed = np.zeros(2)
    normal_x, normal_y, depths, swings, elastics = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    speed_x, speed_y, place_x, place_y = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    own, both = np.zeros(2), 0.0
    for k in range(n):
        own[0] += m.at_end[0, k] * m.at_end[0, k]
        own[1] += m.at_end[1, k] * m.at_end[1, k]
        both += m.at_end[0, k] * m.at_end[1, k]
    forced = spin_columns[HAS_BOW] > 0.0 or spin_columns[HAS_CIRCULATORY] > 0.0 or spin_columns[HAS_HOLDING] > 0.0
    inertia = spin_columns[INERTIA]
    # reciprocals, since divisions are slow
    ring_masses, ring_inertias = 1.0 / columns[:, RING_MASS], 1.0 / columns[:, RING_INERTIA]
    turnings = columns[:, JOURNAL_RADIUS] / inertia
    slides = 1.0 / (
        own
        + ring_masses
        + columns[:, JOURNAL_RADIUS] * turnings
        + (columns[:, JOURNAL_RADIUS] + columns[:, GAP]) ** 2 * ring_inertias
    )
    lights = 1.0 / slides
    powers = np.zeros((2, POWER_STOP))
    # the balls, padded to a multiple of eight with ones that never touch
    most = m.ball_cosine.shape[1]
    balls = np.zeros((2, 3, LANES * ((most + LANES - 1) // LANES)))
    balls[:, 2] = -1.0
    free = np.zeros(2)  # an inner ring nearer than this to the outer ring's centre loads no ball
    for end in range(2):
        powers[end] = power_table(columns[end, CONTACT_POWER])
        for j in range(int(columns[end, BALL_COUNT])):
            balls[end, 0, j], balls[end, 1, j] = m.ball_cosine[end, j], m.ball_sine[end, j]
            balls[end, 2, j] = m.ball_oversize[end, j] - columns[end, HALF_CLEARANCE]
        free[end] = max(0.0, -np.max(balls[end, 2]) - columns[end, WAVES_REACH])

    for row in range(len(times)):
        span = times[row] - t
        count = math.ceil(span / step - 1e-9) if span > 0.0 else 0
        usual = span / count if count > 0 else tabled
        if abs(usual - tabled) > 1e-12 * step:
            tabled = usual
            filled[:] = False
        left = _WHOLE * count  # distance to this instant, in quarters of a usual step
        shorts = 0
        set_directions(turning, columns)
        while left > 0:
            size = USUAL
            if shorts > 0:
                size = SHORT
            elif aloft and left >= PARTS[LONG] and usual * PARTS[LONG] < _WHOLE * (1 + 1e-9) * FLIGHT_STEP:
                size = LONG
            h = usual * PARTS[size] / _WHOLE
            if not filled[size]:
                swing_table(m, tabled * PARTS[size] / _WHOLE, swing_tables[size])
                damper_table(m, tabled * PARTS[size] / _WHOLE, KICK, damper_tables[size])
                filled[size] = True
            now = times[row] - usual * left / _WHOLE
            copy_modes(modal, lanes, kept_modal)
            copy_rings(rings, kept_rings)
            copy_turning(turning, kept_turning)
            for k in range(len(work)):
                kept_work[k] = work[k]
            pressed[0], pressed[1] = 0.0, 0.0
            begun, met = 0, False  # ends in contact at the first kick, as bits; whether that changed
            for stage in range(7):
                # drift
                s = min(stage, 6 - stage)
                tau = DRIFT[s] * h
                now += tau
                x0, y0, u0, v0, x1, y1, u1, v1 = drift(modal, lanes, swing_tables, size, s)
                if stage == 3:
                    lost = 0.0
                    for k in range(n):
                        rate, swerve = modal[RATE_X + k], modal[RATE_Y + k]
                        lost += m.damping[k] * (rate * rate + swerve * swerve)
                    work[MODAL] += h * lost
                move_rings(rings, axes, tau)
                turn_on(turning, axes, tau, columns)
                if stage == 6:
                    break

                # kick
                s = min(stage, 5 - stage)
                tau = KICK[s] * h
                speed_x[0], speed_y[0], speed_x[1], speed_y[1] = u0, v0, u1, v1
                place_x[0], place_y[0], place_x[1], place_y[1] = x0, y0, x1, y1
                damp_rings(rings, axes, damper_tables, size, s)
                # forces that depend on positions
                touched = 0
                for end in range(2):
                    i = 2 * end
                    gap = columns[end, GAP]
                    ex, ey = place_x[end] - rings[RING + i], place_y[end] - rings[RING + i + 1]
                    depths[end], swings[end] = -1.0, 0.0
                    near = max(0.0, gap - columns[end, SHAPE_REACH])
                    if ex * ex + ey * ey <= near * near:
                        pass
                    elif columns[end, SHAPE_REACH] > 0.0:
                        turned = angle[1 + end] - columns[end, RING_ANGLE]
                        normal_x[end], normal_y[end], depths[end], swings[end] = touch_shaped(
                            ex, ey, gap, turned, work[HEAT + end], effect[end]
                        )
                    else:
                        normal_x[end], normal_y[end], depths[end] = touch(ex, ey, gap)
                    if depths[end] > 0.0:
                        touched += 1 + end
                        stiffness = columns[end, CONTACT_STIFFNESS]
                        elastics[end] = stiffness * depths[end] * power(depths[end], powers, end)
                    ex, ey = rings[RING + i] - rings[OUTER + i], rings[RING + i + 1] - rings[OUTER + i + 1]
                    bx, by = 0.0, 0.0
                    if ex * ex + ey * ey > free[end] * free[end]:
                        along = ex * cosines[1 + end] + ey * sines[1 + end]
                        across = ey * cosines[1 + end] - ex * sines[1 + end]
                        ball_stiffness = columns[end, BALL_STIFFNESS]
                        push_along, push_across = 0.0, 0.0
                        waves = columns[end, WAVES_REACH]
                        if waves > 0.0:
                            in_use = int(columns[end, BALL_COUNT])
                            spacing, turned = 2.0 * math.pi / in_use, angle[1 + end]
                            cage = cage_angle(columns[end], turned)
                            for j in range(in_use):
                                press = along * balls[end, 0, j] + across * balls[end, 1, j] + balls[end, 2, j]
                                if press + waves > 0.0:
                                    press += hooks.ball(cage + j * spacing, turned, effect[end])
                                load = ball_load(press, ball_stiffness)
                                push_along -= load * balls[end, 0, j]
                                push_across -= load * balls[end, 1, j]
                        else:
                            for j in range(balls.shape[2]):
                                press = along * balls[end, 0, j] + across * balls[end, 1, j] + balls[end, 2, j]
                                load = ball_load(press, ball_stiffness)
                                push_along -= load * balls[end, 0, j]
                                push_across -= load * balls[end, 1, j]
                        bx = push_along * cosines[1 + end] - push_across * sines[1 + end]
                        by = push_along * sines[1 + end] + push_across * cosines[1 + end]
                        turn_rate = columns[end, CAGE_RATIO] * spin[1 + end]
                        # the cage carries loaded balls along
                        work[EXTERNAL] += tau * (ex * by - ey * bx) * turn_rate
                    ux, uy = rings[OUTER + i] - rings[BASE + i], rings[OUTER + i + 1] - rings[BASE + i + 1]
                    sx, sy = linear_spring(
                        ux, uy, columns[end, SUPPORT_XX], columns[end, SUPPORT_XY], columns[end, SUPPORT_YY]
                    )
                    if columns[end, HAS_SPRING] > 0.0:
                        more_x, more_y = hooks.support(ux, uy, effect[end])
                        sx += more_x
                        sy += more_y
                    rings[BALL_FORCE + i], rings[BALL_FORCE + i + 1] = bx, by
                    rings[SPRING_FORCE + i], rings[SPRING_FORCE + i + 1] = sx, sy

                if stage == 0:
                    begun = touched
                elif touched != begun:
                    met = True
                    if size != SHORT:
                        break

                # contacts
                struck = 0.0  # change of the shaft's speed by the contacts
                for turn in range(2):
                    end = turn if stage < 3 else 1 - turn  # order reversed halfway, so that the step stays symmetric
                    i = 2 * end
                    rubbed = 0.0
                    ring_spin = spin[1 + end]
                    if depths[end] > 0.0:
                        nx, ny, swing, elastic = normal_x[end], normal_y[end], swings[end], elastics[end]
                        ring_mass, ring_inertia, gap = ring_masses[end], ring_inertias[end], columns[end, GAP]
                        bx, by = rings[BALL_FORCE + i], rings[BALL_FORCE + i + 1]
                        vx, vy = speed_x[end] - rings[RING_RATE + i], speed_y[end] - rings[RING_RATE + i + 1]
                        approach = vx * nx + vy * ny + swing * ring_spin
                        radius = columns[end, JOURNAL_RADIUS]
                        slip = spin[0] * radius - ring_spin * (radius + gap) - vx * ny + vy * nx
                        pull_n = -(bx * nx + by * ny) * ring_mass
                        pull_t = (bx * ny - by * nx) * ring_mass
                        light_n = own[end] + ring_mass + swing * swing * ring_inertia
                        light_t = lights[end]
                        mean = mean_press(elastic, approach, pull_n, light_n, 1.5 * columns[end, CONTACT_DAMPING], tau)
                        if stage in (0, 5):  # intermediate states lie off the path, with forces some per cent too high
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
                        rings[IMPULSE + i], rings[IMPULSE + i + 1] = jx, jy
                    work[HEAT + end] += rubbed - tau * columns[end, COOLING_RATE] * work[HEAT + end]
                    slowed = after_drag(ring_spin, columns[end, RING_DRAG] * ring_inertias[end], tau)
                    work[DRAGGED] += 0.5 * (ring_spin * ring_spin - slowed * slowed) * columns[end, RING_INERTIA]
                    spin[1 + end] = slowed

                # the rotor: impulses, weight, unbalance, effects; gyroscopic coupling between their halves
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
                along, across = pull * cosines[0] + gain * sines[0], pull * sines[0] - gain * cosines[0]
                if forced:
                    for k in range(n):
                        modal[MORE_X + k], modal[MORE_Y + k] = 0.0, 0.0
                if spin_columns[HAS_BOW] > 0.0:
                    for k in range(n):
                        modal[MORE_X + k] += tau * square[k] * (m.bow[0, k] * cosines[0] - m.bow[1, k] * sines[0])
                        modal[MORE_Y + k] += tau * square[k] * (m.bow[0, k] * sines[0] + m.bow[1, k] * cosines[0])
                if spin_columns[HAS_CIRCULATORY] > 0.0:
                    for k in range(n):
                        total_a, total_b = 0.0, 0.0
                        for j in range(n):
                            total_a += circulatory[k, j] * modal[X + j]
                            total_b += circulatory[k, j] * modal[Y + j]
                        modal[MORE_X + k] -= tau * total_b
                        modal[MORE_Y + k] += tau * total_a
                if spin_columns[HAS_HOLDING] > 0.0:
                    share = tau * hooks.holding(now, effect[ROTOR_ROW])
                    for j in range(len(m.magnet)):
                        for k in range(n):
                            modal[MORE_X + k] += share * m.at_magnet[j, k] * m.magnet[j, MAGNET_FX]
                            modal[MORE_Y + k] += share * m.at_magnet[j, k] * m.magnet[j, MAGNET_FY]
                turn = tau * middle
                work[EXTERNAL] += push(
                    modal, lanes, along, across,
                    rings[IMPULSE], rings[IMPULSE + 1], rings[IMPULSE + 2], rings[IMPULSE + 3], tau, turn, struck,
                )  # fmt: skip
                # the planes are coupled alternately, in reverse order in the step's second half
                if stage < 3:
                    turn_plane(modal, lanes, gyro, TURN_Y, X, RATE_X, TURN_X, turn, struck)
                    turn_plane(modal, lanes, gyro, TURN_X, Y, RATE_Y, TURN_Y, -turn, -struck)
                else:
                    turn_plane(modal, lanes, gyro, TURN_X, Y, RATE_Y, TURN_Y, -turn, -struck)
                    turn_plane(modal, lanes, gyro, TURN_Y, X, RATE_X, TURN_X, turn, struck)
                # last, since vector loads stall on scalar stores that are still pending
                push_rings(rings, axes, damper_tables, size, s, tau)
            if met and size != SHORT:
                copy_modes(kept_modal, lanes, modal)
                copy_rings(kept_rings, rings)
                copy_turning(kept_turning, turning)
                for k in range(len(work)):
                    work[k] = kept_work[k]
                aloft = False
                if size == USUAL:
                    shorts = _WHOLE
                continue
            left -= PARTS[size]
            shorts = max(0, shorts - 1)
            aloft = touched == 0
            peak[0], peak[1] = max(peak[0], pressed[0]), max(peak[1], pressed[1])
        t = times[row]
        for k in range(len(work)):
            out[row, ledger + k] = work[k]
        store_modes(modal, n, out, row)
        store_rings(rings, n, out, row)
        store_turning(turning, n, out, row)
        if not math.isfinite(modal[X] + modal[Y]):
            return t - span
    if len(times) > 0:
        y[:] = out[len(times) - 1]
    pace[0], pace[1] = tabled, 1.0 if aloft else 0.0
    return t
