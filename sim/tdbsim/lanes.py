"""The splitting for up to eight drops of one rotor side by side, one drop per lane of the processor's vectors.

A single drop is limited by latency (`tdbsim.splitting`), which eight drops share here.  The laws of motion, the order of a step's
parts and the choice of steps are those of `splitting`, and lanes proceed independently: where a contact begins or ends in one,
its step is discarded and repeated in four while the others go on, so lanes may be at different instants.  A drop thus takes the
same steps as alone and differs by rounding only.
"""

from __future__ import annotations

import math

import numpy as np

from tdbsim import state_layout
from tdbsim.cache import called, inlined, reassociated
from tdbsim.columns import (
    CAGE_RATIO,
    CONTACT_POWER,
    DECAY_RATE,
    GRAVITY,
    HAS_BOW,
    HAS_CIRCULATORY,
    HAS_HOLDING,
    HAS_SPRING,
    HAS_WINDAGE,
    INERTIA,
    SHAPE_REACH,
    WAVES_REACH,
)
from tdbsim.kick import DRIFT, KICK, swing_table
from tdbsim.lane_ends import (
    IMPULSE_X,
    IMPULSE_Y,
    KICK_STOP,
    PRESSED,
    TAKEN_STOP,
    bend_support,
    book,
    damp_axis,
    meet,
    press_balls,
    push_axis,
    slow_ring,
    strike,
)
from tdbsim.lane_forces import COUPLED, add_forces, fill_forces, held, slowing
from tdbsim.lane_modes import (
    BLOCK,
    MODE_STATE,
    MODE_STOP,
    RATE_X,
    RATE_Y,
    SWING_STOP,
    TURN_X,
    TURN_Y,
    X,
    Y,
    drift,
    lost,
    push,
    turn_plane,
)
from tdbsim.lane_power import POWERS_STOP, fill_powers
from tdbsim.lane_rows import (
    ANGLE,
    BALL_STOP,
    COSINES,
    END_STOP,
    MODES,
    RING,
    RING_RATE,
    SINES,
    SPIN,
    direct,
    fill_balls,
    fill_ends,
    fill_gyro,
    fill_unbalance,
    flagged,
    keep,
    of_lane,
    read_state,
    room_for,
    take_back,
    write_state,
)
from tdbsim.mode_rows import ALONG as ALONG_ROW
from tdbsim.mode_rows import BACK as BACK_ROW
from tdbsim.mode_rows import LANES as ROW_LANES
from tdbsim.mode_rows import SAME as SAME_ROW
from tdbsim.mode_rows import STAY as STAY_ROW
from tdbsim.mode_rows import SWING_STOP as SWING_ROWS
from tdbsim.ring_rows import DAMPER_STOP, damper_table
from tdbsim.splitting import FLIGHT_STEP, LONG, PARTS, SHORT, USUAL
from tdbsim.state_layout import EXTERNAL, MODAL, WINDAGE
from tdbsim.turning import SMALL_TURN, turned_on
from tdbsim.vectors import LANES, address, beyond, bits, load, masked, spread, store, where

_WHOLE = PARTS[USUAL]
# progress of each lane: next instant, distance to it in parts of a usual step, short steps to come
AHEAD, LEFT, SHORTS, WAY_STOP = range(0, 4 * LANES, LANES)
_PLACES = 12 * LANES  # of the rings


@reassociated
def integrate(m, y, step, times, out, first, peak):  # type: ignore[no-untyped-def]
    """Advance the states of drops from the release through given instants.

    Parameters
    ----------
    m : Arrays
        The rotor's arrays (``square``, ``damping``, ``gyro``, ``at_end``, ``weight``) of the first drop; the others lane by
        lane, surplus lanes repeating one of the drops.
    y : (lanes, size) array
        States at the release, likewise.
    step : float
        The greatest usual step, s.
    times : (k,) array
        Ascending instants, s after the release.
    out : (drops, k + first, size) array
        Filled with the states at them, from the row `first` on.
    first : int
    peak : (drops, 2) array
        Updated to the greatest normal forces, N.

    Returns
    -------
    (lanes,) array
        Times reached, short of the last instant where a state became non-finite.
    """
    n, count = len(m.square), len(out)
    padded = (n + BLOCK - 1) // BLOCK * BLOCK
    # everything in one array: addresses in it need no reference counting
    size_of_state = MODES + padded * MODE_STATE
    most = m.ball_cosine.shape[2] * BALL_STOP
    tables_size = len(DRIFT) * n * SWING_STOP + len(KICK) * TAKEN_STOP
    sizes = (
        size_of_state, size_of_state, 2 * END_STOP, 2 * most, padded * MODE_STOP, 2 * KICK_STOP, 2 * POWERS_STOP, 8 * LANES,
        padded * padded, (len(PARTS) + 1) * tables_size, LANES, n * (COUPLED + n * LANES),
    )  # fmt: skip
    space = room_for(sum(sizes) // LANES + len(sizes))
    state = address(space)
    kept = beyond(state, size_of_state)
    ends = beyond(kept, size_of_state)
    balls_0 = beyond(ends, 2 * END_STOP)
    balls_1 = beyond(balls_0, most)
    modal = beyond(balls_1, most)
    kick = beyond(modal, padded * MODE_STOP)
    powers = beyond(kick, 2 * KICK_STOP)
    room = beyond(powers, 2 * POWERS_STOP)
    gyro = beyond(room, 8 * LANES)
    tables = beyond(gyro, padded * padded)
    mixed = beyond(tables, len(PARTS) * tables_size)
    dampers = beyond(mixed, len(DRIFT) * n * SWING_STOP)
    since = beyond(mixed, tables_size)
    forces = beyond(since, LANES)
    at_end, weight, damping = address(m.at_end), address(m.weight), address(m.damping)
    effects, states = address(m.effect), beyond(address(out), first * out.shape[2])
    read_state(y, n, state)
    fill_ends(m, ends)
    count_0, count_1 = fill_balls(m, 0, balls_0), fill_balls(m, 1, balls_1)
    fill_unbalance(m, modal)
    fill_gyro(m.gyro, gyro)
    fill_forces(m, forces)
    own_0, own_1, both = 0.0, 0.0, 0.0
    for k in range(n):
        own_0 += m.at_end[0, k] * m.at_end[0, k]
        own_1 += m.at_end[1, k] * m.at_end[1, k]
        both += m.at_end[0, k] * m.at_end[1, k]
    for end in range(2):
        fill_powers(m.end[:, end, CONTACT_POWER], beyond(powers, end * POWERS_STOP))
    for a in range(LANES):
        room[a], room[LANES + a] = m.spin[a, GRAVITY], m.spin[a, INERTIA]
        room[2 * LANES + a] = m.spin[a, DECAY_RATE]
    gravity, inertia, decay = load(room, 0), load(room, LANES), load(room, 2 * LANES)
    shaped_0, shaped_1 = flagged(m.end[:, 0], SHAPE_REACH), flagged(m.end[:, 1], SHAPE_REACH)
    wavy_0, wavy_1 = flagged(m.end[:, 0], WAVES_REACH), flagged(m.end[:, 1], WAVES_REACH)
    sprung_0, sprung_1 = flagged(m.end[:, 0], HAS_SPRING), flagged(m.end[:, 1], HAS_SPRING)
    blown = flagged(m.spin, HAS_WINDAGE)
    coupled, holding = flagged(m.spin, HAS_CIRCULATORY), flagged(m.spin, HAS_HOLDING)
    forced = flagged(m.spin, HAS_BOW) | coupled | holding

    ways, reached, parts = np.zeros(WAY_STOP, np.int64), np.zeros(LANES), np.zeros(len(times), np.int64)
    way, to_come, arrived = address(ways), address(parts), address(reached)
    instants = address(times)
    alive, aloft = (1 << count) - 1, 0
    begin = 0
    while begin < len(parts):
        usual, stop = stretch(times, begin, step, parts)
        fill_tables(m, usual, tables)
        shorter_before, longer_before, begun_anew, h = 0, 0, True, spread(0.0)
        flight = usual * PARTS[LONG] < _WHOLE * (1 + 1e-9) * FLIGHT_STEP
        running = 0
        for a in range(count):
            if alive >> a & 1:
                way[AHEAD + a], way[LEFT + a], way[SHORTS + a] = begin, to_come[begin], 0
                direct(state, ends, a)
                if settle(state, ends, n, a, way, instants, to_come, stop, out.shape[1], states, arrived):
                    running |= 1 << a
                elif reached[a] < times[stop - 1]:
                    alive &= ~(1 << a)
        while running != 0:
            # step length of each lane
            shorter, longer = 0, 0
            for a in range(count):
                if running >> a & 1:
                    if way[SHORTS + a] > 0:
                        shorter |= 1 << a
                    elif flight and aloft >> a & 1 and way[LEFT + a] >= PARTS[LONG]:
                        longer |= 1 << a
                    if holding >> a & 1:
                        since[a] = times[way[AHEAD + a]] - usual * way[LEFT + a] / _WHOLE
            if shorter != shorter_before or longer != longer_before or begun_anew:
                shorter_before, longer_before, begun_anew = shorter, longer, False
                short, long = masked(shorter), masked(longer)
                mix(tables, tables_size, short, long, mixed)
                h = where(short, 1.0 * PARTS[SHORT], where(long, 1.0 * PARTS[LONG], 1.0 * _WHOLE)) * (usual / _WHOLE)
            keep(state, kept, size_of_state)
            store(kick, PRESSED, 0.0)
            store(kick, KICK_STOP + PRESSED, 0.0)
            begun_0, begun_1, touched_0, touched_1, met, again = 0, 0, 0, 0, 0, 0
            gone = spread(0.0)
            for stage in range(7):
                # drift
                s = min(stage, 6 - stage)
                tau = DRIFT[s] * h
                gone += tau
                table = beyond(mixed, s * n * SWING_STOP)
                x0, y0, u0, v0, x1, y1, u1, v1 = drift(state, MODES, modal, n, at_end, table)
                if stage == 3:
                    book(state, MODAL, h * lost(state, MODES, n, damping))
                for i in range(0, _PLACES, LANES):
                    store(state, RING + i, load(state, RING + i) + tau * load(state, RING_RATE + i))
                turn_on(state, ends, tau)
                if stage == 6:
                    break

                # kick
                s = min(stage, 5 - stage)
                tau = KICK[s] * h
                at = s * TAKEN_STOP
                for end in range(2):
                    damp_axis(state, kick, dampers, at, end, 0)
                    damp_axis(state, kick, dampers, at, end, 1)
                # forces that depend on positions
                ex, ey = x0 - load(state, RING), y0 - load(state, RING + LANES)
                touched_0 = meet(effects, state, ends, kick, powers, 0, ex, ey, shaped_0)
                ex, ey = x1 - load(state, RING + 2 * LANES), y1 - load(state, RING + 3 * LANES)
                touched_1 = meet(effects, state, ends, kick, powers, 1, ex, ey, shaped_1)
                press_balls(effects, state, ends, kick, balls_0, count_0, 0, tau, wavy_0)
                press_balls(effects, state, ends, kick, balls_1, count_1, 1, tau, wavy_1)
                bend_support(effects, state, ends, kick, 0, sprung_0)
                bend_support(effects, state, ends, kick, 1, sprung_1)
                if stage == 0:
                    begun_0, begun_1 = touched_0, touched_1
                else:
                    met |= (touched_0 ^ begun_0) | (touched_1 ^ begun_1)
                    again = met & running & ~shorter
                    if again == running:
                        break

                # contacts: forth and back, so that the step stays symmetric
                on_path = stage in (0, 5)  # intermediate states lie off it, with forces some per cent too high
                struck = spread(0.0)
                for turn in range(2):
                    rubbed = spread(0.0)
                    if (turn == 0) == (stage < 3):
                        if touched_0 != 0:
                            jx, jy, gain, rubbed = strike(
                                effects, state, ends, kick, 0, touched_0, u0, v0, own_0, tau, on_path, room
                            )
                            struck, u1, v1 = struck + gain, u1 + both * jx, v1 + both * jy
                        slow_ring(state, ends, 0, rubbed, tau, room)
                    else:
                        if touched_1 != 0:
                            jx, jy, gain, rubbed = strike(
                                effects, state, ends, kick, 1, touched_1, u1, v1, own_1, tau, on_path, room
                            )
                            struck, u0, v0 = struck + gain, u0 + both * jx, v0 + both * jy
                        slow_ring(state, ends, 1, rubbed, tau, room)

                # the rotor: impulses, weight, unbalance, effects; gyroscopic coupling between their halves
                omega = load(state, SPIN)
                middle = omega + 0.5 * tau * slowing(effects, omega, decay, blown, room)
                slower = tau * slowing(effects, middle, decay, blown, room)
                store(state, SPIN, omega + slower)
                book(state, WINDAGE, -inertia * slower * middle)
                pull, gain = tau * middle * middle, struck + slower
                cosine, sine = load(state, COSINES), load(state, SINES)
                along, across = pull * cosine + gain * sine, pull * sine - gain * cosine
                if forced != 0:
                    share = held(effects, load(since, 0) + gone, holding, room)
                    add_forces(state, MODES, modal, forces, n, coupled, cosine, sine, share, tau)
                turned = tau * middle
                supplied = push(
                    state, MODES, modal, n, at_end, weight, along, across, load(kick, IMPULSE_X), load(kick, IMPULSE_Y),
                    load(kick, KICK_STOP + IMPULSE_X), load(kick, KICK_STOP + IMPULSE_Y), tau, turned, struck,
                )  # fmt: skip
                book(state, EXTERNAL, supplied)
                # the planes are coupled alternately, in reverse order in the step's second half
                if stage < 3:
                    turn_plane(state, MODES, modal, n, gyro, TURN_Y, X, RATE_X, TURN_X, turned, struck)
                    turn_plane(state, MODES, modal, n, gyro, TURN_X, Y, RATE_Y, TURN_Y, -turned, -struck)
                else:
                    turn_plane(state, MODES, modal, n, gyro, TURN_X, Y, RATE_Y, TURN_Y, -turned, -struck)
                    turn_plane(state, MODES, modal, n, gyro, TURN_Y, X, RATE_X, TURN_X, turned, struck)
                for end in range(2):
                    push_axis(state, ends, kick, dampers, at, end, 0, spread(0.0), tau)
                    push_axis(state, ends, kick, dampers, at, end, 1, gravity, tau)
            discarded = again | ((1 << LANES) - 1 ^ running)
            if discarded != 0:
                take_back(state, kept, size_of_state, discarded)
            touching = touched_0 | touched_1
            for a in range(count):
                if not running >> a & 1:
                    continue
                if again >> a & 1:
                    aloft &= ~(1 << a)
                    if not longer >> a & 1:
                        way[SHORTS + a] = _WHOLE
                    continue
                way[LEFT + a] -= PARTS[SHORT] if shorter >> a & 1 else PARTS[LONG] if longer >> a & 1 else _WHOLE
                way[SHORTS + a] = max(0, way[SHORTS + a] - 1)
                aloft = aloft & ~(1 << a) if touching >> a & 1 else aloft | 1 << a
                for end in range(2):
                    peak[a, end] = max(peak[a, end], kick[end * KICK_STOP + PRESSED + a])
                if way[LEFT + a] == 0 and not settle(
                    state, ends, n, a, way, instants, to_come, stop, out.shape[1], states, arrived
                ):
                    running &= ~(1 << a)
                    if reached[a] < times[stop - 1]:
                        alive &= ~(1 << a)
        begin = stop
    space[0], ways[0] = 0.0, 0  # keeps the arrays alive until here
    return reached


@called
def stretch(times, begin, step, parts):  # type: ignore[no-untyped-def]
    """Return the usual step from an instant on, and the instant at which it changes; fill the parts to each instant."""
    usual, row = 0.0, begin
    while row < len(times):
        span = times[row] - (times[row - 1] if row > 0 else 0.0)
        count = math.ceil(span / step - 1e-9) if span > 0.0 else 0
        if count > 0:
            if usual == 0.0:
                usual = span / count
            if abs(span / count - usual) > 1e-12 * step:
                break
        parts[row] = _WHOLE * count
        row += 1
    return usual, row


@called
def fill_tables(m, usual, tables):  # type: ignore[no-untyped-def]
    """Fill the tables of drifts and dampers for the three step lengths."""
    n = len(m.square)
    swing, damper = np.zeros((len(DRIFT), SWING_ROWS)), np.zeros((len(KICK), DAMPER_STOP))
    i = 0
    for size in range(len(PARTS)):
        h = usual * PARTS[size] / _WHOLE
        swing_table(of_lane(m, 0), h, swing)
        for s in range(len(DRIFT)):
            for k in range(n):
                for part in (SAME_ROW, ALONG_ROW, BACK_ROW, STAY_ROW):
                    store(tables, i, swing[s, part + k])
                    i += LANES
        for a in range(LANES):
            damper_table(of_lane(m, a), h, KICK, damper)
            for s in range(len(KICK)):
                for part in range(5):
                    for axis in range(4):
                        tables[i + s * TAKEN_STOP + (part * 4 + axis) * LANES + a] = damper[s, part * ROW_LANES + axis]
        i += len(KICK) * TAKEN_STOP


@called
def mix(tables, size, short, long, mixed):  # type: ignore[no-untyped-def]
    """Fill the lanes' tables with usual steps or, in the lanes of two masks, short and long ones."""
    for i in range(0, size, LANES):
        other = where(long, load(tables, LONG * size + i), load(tables, USUAL * size + i))
        store(mixed, i, where(short, load(tables, SHORT * size + i), other))


@called
def settle(state, ends, n, a, way, times, parts, stop, rows, out, reached):  # type: ignore[no-untyped-def]
    """Write the state of a lane at each instant reached, and set its next one; return whether any is left."""
    width = state_layout.size(n)
    while way[LEFT + a] == 0:
        row = way[AHEAD + a]
        write_state(state, n, a, beyond(out, (a * rows + row) * width))
        if not math.isfinite(state[MODES + X + a] + state[MODES + Y + a]):
            return False
        reached[a] = times[row]
        if row + 1 == stop:
            return False
        way[AHEAD + a], way[LEFT + a], way[SHORTS + a] = row + 1, parts[row + 1], 0
        direct(state, ends, a)
    return True


@inlined
def turn_on(state, ends, tau):  # type: ignore[no-untyped-def]
    """Advance angles, cosines and sines by the spins; recompute cosines and sines where a turn is large."""
    large = 0
    for k in range(3):
        turn = tau * load(state, SPIN + k * LANES)
        store(state, ANGLE + k * LANES, load(state, ANGLE + k * LANES) + turn)
        large |= bits(abs(turn) > SMALL_TURN)
        if k > 0:
            turn = turn * load(ends, (k - 1) * END_STOP + CAGE_RATIO * LANES)
        cosine, sine = turned_on(load(state, COSINES + k * LANES), load(state, SINES + k * LANES), turn)
        store(state, COSINES + k * LANES, cosine)
        store(state, SINES + k * LANES, sine)
    if large != 0:
        for a in range(LANES):
            if large >> a & 1:
                direct(state, ends, a)
