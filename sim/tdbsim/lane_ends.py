"""A kick at one end of eight drops side by side: forces of balls and support, contact, dampers of the rings.

Everything is computed in all lanes and selected by masks.  Rare cases (`rare` lanes, given as bits) are computed lane by lane
with the functions that `tdbsim.splitting` calls.
"""

from __future__ import annotations

import math

from tdbsim import hooks
from tdbsim.ball_bearing import ball_load
from tdbsim.cache import called, inlined
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
    FRICTION_LOAD,
    FRICTION_POWER,
    GAP,
    HAS_SLIP_LAW,
    JOURNAL_RADIUS,
    RING_ANGLE,
    RING_DRAG,
    RING_INERTIA,
    SHAPE_REACH,
    SUPPORT_DAMPING,
    SUPPORT_XX,
    SUPPORT_XY,
    SUPPORT_YY,
    WAVES_REACH,
)
from tdbsim.contact import touch_shaped
from tdbsim.friction import REGULAR_SLIP, load_share
from tdbsim.kick import (
    SMALL_SLIP,
    STRONG,
    WEAK_DRAG,
    after_drag,
    damped_press,
    drag_grip,
    mean_press,
    slide_by_law,
    slide_by_parts,
    slide_fast,
    slide_slowly,
    weakly_damped,
)
from tdbsim.lane_power import POWERS_STOP, powers_of
from tdbsim.lane_rows import (
    ANGLE,
    ARM,
    BALL_COSINE,
    BALL_PRESS,
    BALL_SINE,
    BALL_STOP,
    BASE,
    BASE_RATE,
    COSINES,
    END_STOP,
    FREE,
    OUTER,
    OUTER_LIGHT,
    OUTER_RATE,
    RING,
    RING_LIGHT,
    RING_RATE,
    RING_TURN,
    SINES,
    SLIDE,
    SLIDE_LIGHT,
    SPIN,
    TURNING,
    WORK,
    effect_of,
)
from tdbsim.ring_rows import damp
from tdbsim.state_layout import DRAGGED, EXTERNAL, HEAT, ROLLED, RUBBED, STRUCK, YIELDED
from tdbsim.support import linear_spring
from tdbsim.vectors import LANES, beyond, bits, load, masked, spread, store, where

# quantities of an end in a kick
(
    NORMAL_X, NORMAL_Y, DEPTH, SWING, ELASTIC, PRESSED, BALL_X, BALL_Y, SPRING_X, SPRING_Y, IMPULSE_X, IMPULSE_Y,
    ROLL_X, ROLL_Y, YIELD_X, YIELD_Y, KICK_STOP,
) = range(0, 17 * LANES, LANES)  # fmt: skip
# damper coefficients for one step length and one kick: five per direction
TAKEN_STOP = 5 * 4 * LANES


@inlined
def meet(effects, state, ends, kick, powers, end, ex, ey, shaped):  # type: ignore[no-untyped-def]
    """Store normals, depths and elastic forces of rotors displaced by (ex, ey) in their rings; return touching lanes as bits."""
    p, q = end * END_STOP, end * KICK_STOP
    gap = load(ends, p + GAP * LANES)
    squared = ex * ex + ey * ey
    near = gap - load(ends, p + SHAPE_REACH * LANES)
    near = where(near > 0.0, near, 0.0)
    within = bits(squared > near * near)
    if within == 0:
        return 0
    distance = math.sqrt(squared)
    share = 1.0 / where(squared > 0.0, distance, 1.0)
    store(kick, q + NORMAL_X, ex * share)
    store(kick, q + NORMAL_Y, ey * share)
    store(kick, q + DEPTH, distance - gap)
    if shaped & within > 0:
        meet_shaped(effects, state, ends, kick, end, ex, ey, shaped & within)
    depth = load(kick, q + DEPTH)
    touched = bits(depth > 0.0)
    if touched > 0:
        depth = where(depth > 0.0, depth, 1.0)
        force = load(ends, p + CONTACT_STIFFNESS * LANES) * depth * powers_of(depth, beyond(powers, end * POWERS_STOP))
        store(kick, q + ELASTIC, where(masked(touched), force, 0.0))
    return touched


@inlined
def meet_shaped(effects, state, ends, kick, end, ex, ey, rare):  # type: ignore[no-untyped-def]
    """Store the same, and the depth's derivative by the ring's angle, for bores that are not round."""
    q = end * KICK_STOP
    store(kick, q + SPRING_X, ex)
    store(kick, q + SPRING_Y, ey)
    _meet_each(effects, state, beyond(ends, end * END_STOP), beyond(kick, q), end, rare)


@called
def _meet_each(effects, state, ends, kick, end, rare):  # type: ignore[no-untyped-def]
    for a in range(LANES):
        if rare >> a & 1:
            turned = state[ANGLE + (1 + end) * LANES + a] - ends[RING_ANGLE * LANES + a]
            kick[NORMAL_X + a], kick[NORMAL_Y + a], kick[DEPTH + a], kick[SWING + a] = touch_shaped(
                kick[SPRING_X + a], kick[SPRING_Y + a], ends[GAP * LANES + a], turned,
                state[WORK + (HEAT + end) * LANES + a], effect_of(effects, a, end),
            )  # fmt: skip


@inlined
def press_balls(effects, state, ends, kick, balls, count, end, tau, wavy):  # type: ignore[no-untyped-def]
    """Store the forces of the balls on the inner rings, and book the work supplied by the turning of the cages."""
    p, q, i = end * END_STOP, end * KICK_STOP, 2 * end * LANES
    ex = load(state, RING + i) - load(state, OUTER + i)
    ey = load(state, RING + i + LANES) - load(state, OUTER + i + LANES)
    free = load(ends, p + FREE)
    beyond_free = bits(ex * ex + ey * ey > free * free)
    if beyond_free == 0:
        store(kick, q + BALL_X, 0.0)
        store(kick, q + BALL_Y, 0.0)
        return
    cosine, sine = load(state, COSINES + (1 + end) * LANES), load(state, SINES + (1 + end) * LANES)
    along, across = ex * cosine + ey * sine, ey * cosine - ex * sine
    stiffness = load(ends, p + BALL_STIFFNESS * LANES)
    push_along, push_across = spread(0.0), spread(0.0)
    for at in range(0, count * BALL_STOP, BALL_STOP):
        c, s = load(balls, at + BALL_COSINE), load(balls, at + BALL_SINE)
        press = along * c + across * s + load(balls, at + BALL_PRESS)
        press = where(press > 0.0, press, 0.0)
        force = press * math.sqrt(press)
        push_along -= force * c
        push_across -= force * s
    push_along, push_across = stiffness * push_along, stiffness * push_across
    store(kick, q + BALL_X, push_along * cosine - push_across * sine)
    store(kick, q + BALL_Y, push_along * sine + push_across * cosine)
    if wavy & beyond_free > 0:
        press_wavy(effects, state, beyond(ends, p), beyond(kick, q), balls, end, wavy & beyond_free)
    bx, by = load(kick, q + BALL_X), load(kick, q + BALL_Y)
    rate = load(ends, p + CAGE_RATIO * LANES) * load(state, SPIN + (1 + end) * LANES)
    book(state, EXTERNAL, tau * (ex * by - ey * bx) * rate)


@called
def press_wavy(effects, state, ends, kick, balls, end, rare):  # type: ignore[no-untyped-def]
    """Store the forces of the balls on wavy raceways."""
    i = 2 * end * LANES
    for a in range(LANES):
        if rare >> a & 1:
            ex, ey = (
                state[RING + i + a] - state[OUTER + i + a],
                state[RING + i + LANES + a] - state[OUTER + i + LANES + a],
            )
            count, turned = int(ends[BALL_COUNT * LANES + a]), state[ANGLE + (1 + end) * LANES + a]
            cosine, sine = state[COSINES + (1 + end) * LANES + a], state[SINES + (1 + end) * LANES + a]
            along, across = ex * cosine + ey * sine, ey * cosine - ex * sine
            cage = ends[CAGE_ANGLE * LANES + a] + ends[CAGE_RATIO * LANES + a] * (turned - ends[RING_ANGLE * LANES + a])
            waves, push_along, push_across = ends[WAVES_REACH * LANES + a], 0.0, 0.0
            for j in range(count):
                at = j * BALL_STOP + a
                press = along * balls[at + BALL_COSINE] + across * balls[at + BALL_SINE] + balls[at + BALL_PRESS]
                if press + waves > 0.0:
                    press += hooks.ball(cage + j * (2.0 * math.pi / count), turned, effect_of(effects, a, end))
                load = ball_load(press, ends[BALL_STIFFNESS * LANES + a])
                push_along -= load * balls[at + BALL_COSINE]
                push_across -= load * balls[at + BALL_SINE]
            kick[BALL_X + a] = push_along * cosine - push_across * sine
            kick[BALL_Y + a] = push_along * sine + push_across * cosine


@inlined
def bend_support(effects, state, ends, kick, end, sprung):  # type: ignore[no-untyped-def]
    """Store the forces of the supports on the outer rings."""
    p, q, i = end * END_STOP, end * KICK_STOP, 2 * end * LANES
    x = load(state, OUTER + i) - load(state, BASE + i)
    y = load(state, OUTER + i + LANES) - load(state, BASE + i + LANES)
    xx, xy, yy = (
        load(ends, p + SUPPORT_XX * LANES),
        load(ends, p + SUPPORT_XY * LANES),
        load(ends, p + SUPPORT_YY * LANES),
    )
    sx, sy = linear_spring(x, y, xx, xy, yy)
    store(kick, q + SPRING_X, sx)
    store(kick, q + SPRING_Y, sy)
    if sprung > 0:
        for a in range(LANES):
            if sprung >> a & 1:
                more_x, more_y = hooks.support(
                    state[OUTER + i + a] - state[BASE + i + a],
                    state[OUTER + i + LANES + a] - state[BASE + i + LANES + a],
                    effect_of(effects, a, end),
                )
                kick[q + SPRING_X + a] += more_x
                kick[q + SPRING_Y + a] += more_y


@inlined
def book(state, kind, work):  # type: ignore[no-untyped-def]
    """Add work to an entry of the ledger."""
    store(state, WORK + kind * LANES, load(state, WORK + kind * LANES) + work)


@inlined
def strike(effects, state, ends, kick, end, touched, speed_x, speed_y, own, tau, on_path, room):  # type: ignore[no-untyped-def]
    """Apply normal and friction forces where rotors touch; return impulses, change of the shafts' speed, friction work.

    (speed_x, speed_y) : the rotors' velocities there; `own` : their change per unit of impulse; `on_path` : whether the states
    lie on the trajectory, so that their forces count as peaks; `room` : work space for the lanes.
    """
    p, q, i = end * END_STOP, end * KICK_STOP, 2 * end * LANES
    which = masked(touched)
    nx, ny, swing = load(kick, q + NORMAL_X), load(kick, q + NORMAL_Y), load(kick, q + SWING)
    elastic = load(kick, q + ELASTIC)
    ring_light, ring_turn = load(ends, p + RING_LIGHT), load(ends, p + RING_TURN)
    spin, ring_spin = load(state, SPIN), load(state, SPIN + (1 + end) * LANES)
    radius, arm = load(ends, p + JOURNAL_RADIUS * LANES), load(ends, p + ARM)
    bx, by = load(kick, q + BALL_X), load(kick, q + BALL_Y)
    vx, vy = speed_x - load(state, RING_RATE + i), speed_y - load(state, RING_RATE + i + LANES)
    approach = vx * nx + vy * ny + swing * ring_spin
    slip = spin * radius - ring_spin * arm - vx * ny + vy * nx
    pull_n, pull_t = -(bx * nx + by * ny) * ring_light, (bx * ny - by * nx) * ring_light
    light_n = own + ring_light + swing * swing * ring_turn
    damping = 1.5 * load(ends, p + CONTACT_DAMPING * LANES)
    rate = light_n * elastic * damping * tau
    phi1, phi2 = weakly_damped(rate)
    mean = damped_press(elastic, approach, pull_n, light_n, damping, tau, phi1, phi2)
    mean = where(mean > 0.0, mean, 0.0)
    strong = bits(abs(rate) > STRONG) & touched
    if strong > 0:
        mean = press_strongly(room, strong, mean, elastic, approach, pull_n, light_n, damping, tau)
    if on_path:
        store(kick, q + PRESSED, where(which & (mean > load(kick, q + PRESSED)), mean, load(kick, q + PRESSED)))
    grip = mean * load(ends, p + SLIDE_LIGHT)
    power = load(ends, p + FRICTION_POWER * LANES)
    if bits((power > 0.0) | (power < 0.0)) & touched > 0:
        store(room, 0, mean)
        _share_each(beyond(ends, p), room, touched)
        grip *= load(room, 0)
    coefficient = load(ends, p + FRICTION * LANES)
    changed = slide_fast(slip, pull_t, grip, tau, coefficient)
    by_law = load(ends, p + HAS_SLIP_LAW * LANES) > 0.0
    slow = abs(slip) <= SMALL_SLIP
    if bits(slow) & touched > 0:
        changed = where(slow, slide_by_parts(slip, pull_t, grip, tau, coefficient), changed)
    rare = bits(by_law | (grip * coefficient * abs(tau) > REGULAR_SLIP)) & touched
    if rare > 0:
        changed = slide_rarely(effects, ends, room, end, rare, changed, slip, pull_t, grip, tau)
    rub = (changed - pull_t * tau) * load(ends, p + SLIDE)
    press = mean * tau
    rub, press = where(which, rub, 0.0), where(which, press, 0.0)
    jx, jy = -press * nx - rub * ny, -press * ny + rub * nx
    middle = approach + 0.5 * (pull_n * tau - light_n * press)
    book(state, STRUCK + end, where(which, (press - elastic * tau) * middle, 0.0))
    rubbed = where(which, -rub * (slip + 0.5 * changed), 0.0)
    book(state, RUBBED + end, rubbed)
    store(kick, q + IMPULSE_X, jx)
    store(kick, q + IMPULSE_Y, jy)
    gain = rub * load(ends, p + TURNING)
    store(state, SPIN, spin + gain)
    store(state, SPIN + (1 + end) * LANES, ring_spin - (rub * arm + press * swing) * ring_turn)
    return jx, jy, gain, rubbed


@called
def _share_each(ends, room, rare):  # type: ignore[no-untyped-def]
    for a in range(LANES):
        if rare >> a & 1:
            room[a] = load_share(room[a], ends[FRICTION_POWER * LANES + a], ends[FRICTION_LOAD * LANES + a])


@inlined
def press_strongly(room, rare, mean, elastic, approach, pull, light, damping, tau):  # type: ignore[no-untyped-def]
    """Return mean forces, those of contacts strongly damped in a kick replaced."""
    store(room, 0, mean)
    store(room, LANES, elastic)
    store(room, 2 * LANES, approach)
    store(room, 3 * LANES, pull)
    store(room, 4 * LANES, light)
    store(room, 5 * LANES, damping)
    store(room, 6 * LANES, tau)
    _press_each(room, rare)
    return load(room, 0)


@called
def _press_each(room, rare):  # type: ignore[no-untyped-def]
    for a in range(LANES):
        if rare >> a & 1:
            room[a] = mean_press(
                room[LANES + a], room[2 * LANES + a], room[3 * LANES + a], room[4 * LANES + a],
                room[5 * LANES + a], room[6 * LANES + a],
            )  # fmt: skip


@inlined
def slide_rarely(effects, ends, room, end, rare, changed, slip, pull, grip, tau):  # type: ignore[no-untyped-def]
    """Return changes of the slip, those of slow slips, or with effects on the coefficient, replaced."""
    store(room, 0, changed)
    store(room, LANES, slip)
    store(room, 2 * LANES, pull)
    store(room, 3 * LANES, grip)
    store(room, 4 * LANES, tau)
    _slide_each(effects, beyond(ends, end * END_STOP), room, end, rare)
    return load(room, 0)


@called
def _slide_each(effects, ends, room, end, rare):  # type: ignore[no-untyped-def]
    for a in range(LANES):
        if rare >> a & 1:
            slip, pull, grip, tau = room[LANES + a], room[2 * LANES + a], room[3 * LANES + a], room[4 * LANES + a]
            coefficient = ends[FRICTION * LANES + a]
            if ends[HAS_SLIP_LAW * LANES + a] > 0.0:
                room[a] = slide_by_law(slip, pull, grip, tau, coefficient, effect_of(effects, a, end))
            else:
                room[a] = slide_slowly(slip, pull, grip, tau, coefficient)


@inlined
def slow_ring(state, ends, end, rubbed, tau, room):  # type: ignore[no-untyped-def]
    """Add and dissipate frictional heat, and apply the drag to the inner rings."""
    p = end * END_STOP
    heat = load(state, WORK + (HEAT + end) * LANES)
    book(state, HEAT + end, rubbed - tau * load(ends, p + COOLING_RATE * LANES) * heat)
    spin = load(state, SPIN + (1 + end) * LANES)
    drag = load(ends, p + RING_DRAG * LANES) * load(ends, p + RING_TURN)
    grip = drag_grip(spin, drag, tau)
    slowed = spin * (1.0 - grip)
    rare = bits(abs(grip) >= WEAK_DRAG)
    if rare > 0:
        store(room, 0, slowed)
        store(room, LANES, spin)
        store(room, 2 * LANES, drag)
        store(room, 3 * LANES, tau)
        _drag_each(room, rare)
        slowed = load(room, 0)
    book(state, DRAGGED, 0.5 * (spin * spin - slowed * slowed) * load(ends, p + RING_INERTIA * LANES))
    store(state, SPIN + (1 + end) * LANES, slowed)


@called
def _drag_each(room, rare):  # type: ignore[no-untyped-def]
    for a in range(LANES):
        if rare >> a & 1:
            room[a] = after_drag(room[LANES + a], room[2 * LANES + a], room[3 * LANES + a])


@inlined
def damp_axis(state, kick, taken, at, end, axis):  # type: ignore[no-untyped-def]
    """Apply the dampers along an axis for the kick's first half, before any impulse."""
    i, q = (2 * end + axis) * LANES, end * KICK_STOP + axis * LANES
    ring, outer, base = damped(
        taken, at, i, load(state, RING_RATE + i), load(state, OUTER_RATE + i), load(state, BASE_RATE + i)
    )
    store(state, RING_RATE + i, ring)
    store(state, OUTER_RATE + i, outer)
    store(state, BASE_RATE + i, base)
    store(kick, q + ROLL_X, ring - outer)
    store(kick, q + YIELD_X, outer - base)
    store(kick, q + IMPULSE_X, 0.0)


@inlined
def damped(taken, at, i, ring, outer, base):  # type: ignore[no-untyped-def]
    """Return velocities along an axis after half a kick of the dampers."""
    i += at
    return damp(
        ring, outer, base, load(taken, i), load(taken, i + 4 * LANES), load(taken, i + 8 * LANES),
        load(taken, i + 12 * LANES), load(taken, i + 16 * LANES),
    )  # fmt: skip


@inlined
def push_axis(state, ends, kick, taken, at, end, axis, fall, tau):  # type: ignore[no-untyped-def]
    """Apply forces and impulses along an axis for the whole kick, and the dampers for its second half; book their work."""
    p, i, q = end * END_STOP, (2 * end + axis) * LANES, end * KICK_STOP + axis * LANES
    ball, spring, impulse = load(kick, q + BALL_X), load(kick, q + SPRING_X), load(kick, q + IMPULSE_X)
    held = load(ends, p + FOUNDATION_STIFFNESS * LANES) * load(state, BASE + i)
    ring = load(state, RING_RATE + i) + (tau * ball - impulse) * load(ends, p + RING_LIGHT) - tau * fall
    outer = load(state, OUTER_RATE + i) + tau * (spring - ball) * load(ends, p + OUTER_LIGHT)
    base = load(state, BASE_RATE + i) - tau * load(ends, p + FOUNDATION_MOBILITY * LANES) * (spring + held)
    roll, sway = 0.5 * (load(kick, q + ROLL_X) + ring - outer), 0.5 * (load(kick, q + YIELD_X) + outer - base)
    book(state, ROLLED + end, tau * load(ends, p + BALL_DAMPING * LANES) * roll * roll)
    support, base_damping = load(ends, p + SUPPORT_DAMPING * LANES), load(ends, p + FOUNDATION_DAMPING * LANES)
    book(state, YIELDED + end, tau * (support * sway * sway + base_damping * base * base))
    ring, outer, base = damped(taken, at, i, ring, outer, base)
    store(state, RING_RATE + i, ring)
    store(state, OUTER_RATE + i, outer)
    store(state, BASE_RATE + i, base)
