"""The drop itself: one compiled Runge-Kutta kernel of fixed steps through levitation, fall and contacts.

State of a drop, in this order (N modes a plane):

    qx, qy, qx', qy'                                        4 N   modal coordinates of the rotor
    shaft angle, speed                                      2
    per end: ring x, y, x', y'; ring angle, ring speed; cage angle; support x, y, x', y'; foundation x, y, x', y'; heat

x right, y up, the rotor turns from +x to +y; positions count from the bearing centres, SI.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

PER_END = 16
GRAVITY = 9.80665


class Bearing(NamedTuple):
    """One touchdown bearing with its support; everything from `friction_excess` on is off at its default."""

    journal_radius: float
    gap: float
    contact_stiffness: float
    contact_exponent: float
    contact_damping: float
    damping_form: int  # 0 Hunt-Crossley, 1 Lankarani-Nikravesh, 2 Flores
    friction: float
    friction_form: int  # 0 tanh, 1 arctangent, 2 algebraic
    slip_speed: float  # where friction has come up, m/s
    load_exponent: float  # the coefficient falls with this power of load
    load_reference: float  # N
    ring_mass: float
    ring_inertia: float
    ring_drag: float
    balls: int
    cage_ratio: float  # cage speed over ring speed
    ball_clearance: float  # diametral
    ball_stiffness: float
    ball_damping: float
    support_mass: float
    support_stiffness: float
    support_damping: float
    friction_excess: float = 0.0  # static over sliding
    stribeck_speed: float = 1.0
    stribeck_exponent: float = 2.0
    oval: float = 0.0
    oval_angle: float = 0.0
    lobe: float = 0.0
    lobe_order: float = 2.0
    lobe_phase: float = 0.0
    inner_wave: float = 0.0
    outer_wave: float = 0.0
    wave_order: float = 2.0
    wave_phase: float = 0.0
    odd_ball: int = -1
    odd_excess: float = 0.0
    soft_ratio: float = 1.0
    soft_angle: float = 0.0
    play: float = 0.0
    play_ratio: float = 1.0
    cubic: float = 0.0
    foundation_mass: float = 0.0  # 0: rigid ground
    foundation_stiffness: float = 0.0
    foundation_damping: float = 0.0
    growth: float = 0.0  # of the gap's closure, m/J
    cooling_rate: float = 0.0  # of the heat that closes it, 1/s
    floor_x: float = 0.0  # motion of the ground: amplitudes, m
    floor_y: float = 0.0
    floor_frequency: float = 0.0  # rad/s
    floor_phase: float = 0.0
    support_friction: float = 0.0  # N
    cage_knock: float = 0.0  # N, once a turn of the cage
    film: float = 0.0  # damping of a fluid between journal and ring, N s/m


class Rotor(NamedTuple):
    """The rotor in modal coordinates; shapes are (places, N)."""

    frequency: Array
    damping: Array  # 2 zeta omega
    gyroscopic: Array
    weight: Array
    polar_inertia: float
    decay_rate: float
    quadratic_rate: float  # of the speed, 1/rad
    touchdown: Array
    magnet: Array
    probe: Array
    seal: Array  # (N,) place of the plane stiffness
    seal_direct: float  # force along displacement, N/m
    seal_cross: float  # force across displacement, N/m
    unbalance: Array  # (2, N): modal in-phase and quadrature parts, kg m
    late_unbalance: Array
    late_time: float
    bow: Array  # (2, N): modal deflection of the bent shaft


class Magnets(NamedTuple):
    """Both magnetic bearings: closed-loop spring and damper while levitated, and what follows."""

    stiffness: Array  # (2,)
    damping: Array
    set_point: Array  # (2, 2): bearing, x or y
    holding: Array  # (2, 2), N
    release_time: float
    decay_time: float  # 0: gone at once
    kick_time: float
    kick_length: float
    kick_force: Array  # (2, 2), N


@njit(cache=True)
def _normal_force(b: Bearing, depth: float, closing: float, entry: float) -> float:
    """Force of rotor on ring for an indentation and its rate; `entry` is the approach speed of this contact."""
    if depth <= 0.0:
        return 0.0
    h = 1.5 * b.contact_damping
    if b.damping_form != 0:
        speed = max(entry, 1e-3)
        restitution = max(1.0 - b.contact_damping * speed, 0.1)
        if b.damping_form == 1:
            h = 0.75 * (1.0 - restitution * restitution) / speed
        else:
            h = 1.6 * (1.0 - restitution) / (restitution * speed)
    return max(b.contact_stiffness * depth**b.contact_exponent * (1.0 + h * closing), 0.0)


@njit(cache=True)
def _friction(b: Bearing, load: float, slip: float) -> float:
    """Friction force against a slip speed."""
    mu = b.friction
    if b.friction_excess != 0.0:
        mu += b.friction_excess * np.exp(-((abs(slip) / b.stribeck_speed) ** b.stribeck_exponent))
    if b.load_exponent != 0.0:
        mu *= (load / b.load_reference) ** (-b.load_exponent)
    u = slip / b.slip_speed
    if b.friction_form == 0:
        rise = np.tanh(u)
    elif b.friction_form == 1:
        rise = 2.0 / np.pi * np.arctan(np.pi / 2.0 * u)
    else:
        rise = u / np.sqrt(1.0 + u * u)
    return mu * load * rise


@njit(cache=True)
def _gap(b: Bearing, direction: float, ring_angle: float, heat: float) -> float:
    """Clearance in the direction of the contact."""
    gap = b.gap - b.growth * heat
    if b.oval != 0.0:
        gap += b.oval * np.cos(2.0 * (direction - b.oval_angle))
    if b.lobe != 0.0:
        gap += b.lobe * np.cos(b.lobe_order * (direction - ring_angle) - b.lobe_phase)
    return gap


@njit(cache=True)
def _ball_force(b: Bearing, x: float, y: float, ring_angle: float, cage_angle: float) -> tuple[float, float]:
    """Force of the balls on the ring at a displacement of ring against outer ring."""
    fx, fy = 0.0, 0.0
    c, s = np.cos(cage_angle), np.sin(cage_angle)
    turn_c, turn_s = np.cos(2.0 * np.pi / b.balls), np.sin(2.0 * np.pi / b.balls)
    for j in range(b.balls):
        depth = x * c + y * s - 0.5 * b.ball_clearance
        if j == b.odd_ball:
            depth += b.odd_excess
        if b.inner_wave != 0.0 or b.outer_wave != 0.0:
            azimuth = cage_angle + 2.0 * np.pi * j / b.balls
            depth += b.inner_wave * np.cos(b.wave_order * (azimuth - ring_angle) - b.wave_phase)
            depth += b.outer_wave * np.cos(b.wave_order * azimuth - b.wave_phase)
        if depth > 0.0:
            q = b.ball_stiffness * depth * np.sqrt(depth)
            fx -= q * c
            fy -= q * s
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    return fx, fy


@njit(cache=True)
def _support_force(b: Bearing, x: float, y: float, vx: float, vy: float) -> tuple[float, float]:
    """Force of the support on the bearing, at a displacement and velocity against what it stands on."""
    kx, ky = b.support_stiffness, b.support_stiffness
    c, s = np.cos(b.soft_angle), np.sin(b.soft_angle)
    along, across = b.soft_ratio * kx * (x * c + y * s), ky * (y * c - x * s)
    fx, fy = along * c - across * s, along * s + across * c
    if b.play > 0.0 or b.cubic != 0.0:
        r = np.sqrt(x * x + y * y)
        if b.play > 0.0:
            # beyond the play a seat without friction is pressed, radially: the gradient of (1 - play/r)^2 r K r / 2
            seat = 0.0 if r <= b.play else 1.0 - b.play / r
            press = (1.0 - b.play_ratio) * seat
            inwards = 0.0 if r <= b.play else press * b.play / r * (fx * x + fy * y) / (r * r)
            share = b.play_ratio + press * seat
            fx, fy = share * fx + inwards * x, share * fy + inwards * y
        fx += b.cubic * r * r * x
        fy += b.cubic * r * r * y
    fx += b.support_damping * vx
    fy += b.support_damping * vy
    if b.support_friction != 0.0:
        v = np.sqrt(vx * vx + vy * vy)
        share = b.support_friction * np.tanh(v / 2e-3) / max(v, 1e-12)
        fx, fy = fx + share * vx, fy + share * vy
    return -fx, -fy


@njit(cache=True)
def _rates(
    t: float,
    s: Array,
    ds: Array,
    rotor: Rotor,
    bearings: tuple[Bearing, Bearing],
    magnets: Magnets,
    levitated: bool,
    frozen: Array,
    entry: Array,
    seen: Array,
) -> None:
    """Rates `ds` of the state `s`; `seen` takes indentation rate and contact force of each end."""
    n = rotor.frequency.size
    qx, qy, vx, vy = s[:n], s[n : 2 * n], s[2 * n : 3 * n], s[3 * n : 4 * n]
    ax, ay = ds[2 * n : 3 * n], ds[3 * n : 4 * n]
    angle, speed = s[4 * n], s[4 * n + 1]
    ds[: 2 * n] = s[2 * n : 4 * n]
    for i in range(n):
        stiff = rotor.frequency[i] * rotor.frequency[i]
        ax[i] = -stiff * qx[i] - rotor.damping[i] * vx[i]
        ay[i] = -stiff * qy[i] - rotor.damping[i] * vy[i] - GRAVITY * rotor.weight[i]

    torque = 0.0
    for e in range(2):
        b = bearings[e]
        phi = rotor.touchdown[e]
        z = s[4 * n + 2 + e * PER_END : 4 * n + 2 + (e + 1) * PER_END]
        dz = ds[4 * n + 2 + e * PER_END : 4 * n + 2 + (e + 1) * PER_END]
        px, py, ux, uy = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            px += phi[i] * qx[i]
            py += phi[i] * qy[i]
            ux += phi[i] * vx[i]
            uy += phi[i] * vy[i]
        x, y = px - z[0], py - z[1]
        wx, wy = ux - z[2], uy - z[3]
        r = np.sqrt(x * x + y * y)
        fx, fy, twist, power = 0.0, 0.0, 0.0, 0.0
        seen[e, 0], seen[e, 1] = 0.0, 0.0
        if r > 0.5 * b.gap:
            cx, cy = x / r, y / r
            closing = wx * cx + wy * cy
            depth = r - _gap(b, np.arctan2(y, x), z[4], z[15])
            if depth > 0.0:
                load = _normal_force(b, depth, closing, entry[e])
                across = wy * cx - wx * cy
                slip = across + speed * b.journal_radius - z[5] * (b.journal_radius + b.gap)
                rub = _friction(b, load, slip)
                fx, fy = load * cx - rub * cy, load * cy + rub * cx  # on the ring
                twist = rub
                power = abs(rub * slip)
                seen[e, 0], seen[e, 1] = closing, load
        if b.film != 0.0 and not levitated:
            fx += b.film * wx
            fy += b.film * wy
        for i in range(n):
            ax[i] -= phi[i] * fx
            ay[i] -= phi[i] * fy
        torque += twist * b.journal_radius

        bx, by = _ball_force(b, z[0] - z[7], z[1] - z[8], z[4], z[6])
        bx -= b.ball_damping * (z[2] - z[9])
        by -= b.ball_damping * (z[3] - z[10])
        if b.cage_knock != 0.0:
            turn = z[6] % (2.0 * np.pi)
            if turn < 0.15:
                knock = b.cage_knock * np.sin(np.pi * turn / 0.15)
                bx += knock * np.cos(z[6])
                by += knock * np.sin(z[6])
        dz[0], dz[1] = z[2], z[3]
        dz[2] = (fx + bx) / b.ring_mass
        dz[3] = (fy + by) / b.ring_mass - GRAVITY
        dz[4] = z[5]
        drag = b.ring_drag * np.tanh(z[5] / 0.5)
        dz[5] = (twist * (b.journal_radius + b.gap) - drag) / b.ring_inertia
        dz[6] = b.cage_ratio * z[5]
        gx, gy, hx, hy = z[11], z[12], z[13], z[14]
        if b.floor_frequency != 0.0:
            phase = b.floor_frequency * t + b.floor_phase
            gx += b.floor_x * np.sin(phase)
            gy += b.floor_y * np.sin(phase)
            hx += b.floor_x * b.floor_frequency * np.cos(phase)
            hy += b.floor_y * b.floor_frequency * np.cos(phase)
        sx, sy = _support_force(b, z[7] - gx, z[8] - gy, z[9] - hx, z[10] - hy)
        dz[7], dz[8] = z[9], z[10]
        dz[9] = (sx - bx) / b.support_mass
        dz[10] = (sy - by) / b.support_mass
        dz[11], dz[12], dz[13], dz[14] = 0.0, 0.0, 0.0, 0.0
        if b.foundation_mass > 0.0:
            dz[11], dz[12] = z[13], z[14]
            dz[13] = (-sx - b.foundation_stiffness * z[11] - b.foundation_damping * z[13]) / b.foundation_mass
            dz[14] = (-sy - b.foundation_stiffness * z[12] - b.foundation_damping * z[14]) / b.foundation_mass
        dz[15] = power - b.cooling_rate * z[15]

        phi = rotor.magnet[e]
        if levitated:
            px, py, ux, uy = 0.0, 0.0, 0.0, 0.0
            for i in range(n):
                px += phi[i] * qx[i]
                py += phi[i] * qy[i]
                ux += phi[i] * vx[i]
                uy += phi[i] * vy[i]
            mx = magnets.holding[e, 0] - magnets.stiffness[e] * (px - magnets.set_point[e, 0]) - magnets.damping[e] * ux
            my = magnets.holding[e, 1] - magnets.stiffness[e] * (py - magnets.set_point[e, 1]) - magnets.damping[e] * uy
            frozen[e, 0], frozen[e, 1] = mx, my
        else:
            mx, my = 0.0, 0.0
            if magnets.decay_time > 0.0:
                share = np.exp(-(t - magnets.release_time) / magnets.decay_time)
                mx, my = share * frozen[e, 0], share * frozen[e, 1]
            late = t - magnets.kick_time
            if 0.0 < late < magnets.kick_length:
                share = np.sin(np.pi * late / magnets.kick_length)
                mx += share * magnets.kick_force[e, 0]
                my += share * magnets.kick_force[e, 1]
        for i in range(n):
            ax[i] += phi[i] * mx
            ay[i] += phi[i] * my

    gain = -rotor.decay_rate * speed - rotor.quadratic_rate * speed * speed - torque / rotor.polar_inertia
    ds[4 * n], ds[4 * n + 1] = speed, gain

    if rotor.seal_direct != 0.0 or rotor.seal_cross != 0.0:
        px, py = 0.0, 0.0
        for i in range(n):
            px += rotor.seal[i] * qx[i]
            py += rotor.seal[i] * qy[i]
        fx = rotor.seal_direct * px - rotor.seal_cross * py
        fy = rotor.seal_direct * py + rotor.seal_cross * px
        for i in range(n):
            ax[i] += rotor.seal[i] * fx
            ay[i] += rotor.seal[i] * fy

    c, sn = np.cos(angle), np.sin(angle)
    whole, part = speed * speed, gain  # (w^2 - i w') e^(i theta)
    lost = 1.0 if t >= rotor.late_time else 0.0
    for i in range(n):
        a = rotor.unbalance[0, i] + lost * rotor.late_unbalance[0, i]
        b_ = rotor.unbalance[1, i] + lost * rotor.late_unbalance[1, i]
        re, im = whole * a + part * b_, whole * b_ - part * a
        stiff = rotor.frequency[i] * rotor.frequency[i]
        re += stiff * rotor.bow[0, i]
        im += stiff * rotor.bow[1, i]
        ax[i] += re * c - im * sn
        ay[i] += re * sn + im * c

    for j in range(n):  # w G q' + w' G q, crosswise
        wx = speed * vx[j] + gain * qx[j]
        wy = speed * vy[j] + gain * qy[j]
        for i in range(n):
            g = rotor.gyroscopic[j, i]
            ax[i] -= g * wy
            ay[i] += g * wx


@njit(cache=True)
def integrate(
    state: Array,
    rotor: Rotor,
    bearings: tuple[Bearing, Bearing],
    magnets: Magnets,
    samples: int,
    interval: float,
    steps: int,
) -> tuple[Array, Array, Array, Array]:
    """Integrate with `steps` Runge-Kutta steps of order four a sample.

    Returns
    -------
    places : (samples, probes, 2) positions of the shaft at the probe planes, m
    turning : (samples, 4) shaft angle, speed, ring speeds
    force : (samples, 2) contact force of each end, the largest within the sample interval, N
    last : the final state
    """
    n = rotor.frequency.size
    probes = rotor.probe.shape[0]
    places = np.zeros((samples, probes, 2))
    turning = np.zeros((samples, 4))
    force = np.zeros((samples, 2))
    s = state.copy()
    trial = np.empty_like(s)
    k1, k2, k3, k4 = np.empty_like(s), np.empty_like(s), np.empty_like(s), np.empty_like(s)
    frozen = np.zeros((2, 2))
    entry = np.zeros(2)
    touching = np.zeros(2)
    seen = np.zeros((2, 2))
    h = interval / steps
    release = int(np.rint(magnets.release_time / h))
    for k in range(samples):
        for p in range(probes):
            for i in range(n):
                places[k, p, 0] += rotor.probe[p, i] * s[i]
                places[k, p, 1] += rotor.probe[p, i] * s[n + i]
        turning[k, 0], turning[k, 1] = s[4 * n], s[4 * n + 1]
        for e in range(2):
            turning[k, 2 + e] = s[4 * n + 2 + e * PER_END + 5]
        for m in range(steps):
            count = k * steps + m
            t = count * h
            levitated = count < release
            _rates(t, s, k1, rotor, bearings, magnets, levitated, frozen, entry, seen)
            for e in range(2):
                if seen[e, 1] > 0.0 and touching[e] == 0.0:
                    entry[e] = seen[e, 0]
                touching[e] = 1.0 if seen[e, 1] > 0.0 else 0.0
                force[k, e] = max(force[k, e], seen[e, 1])
            for i in range(s.size):
                trial[i] = s[i] + 0.5 * h * k1[i]
            _rates(t + 0.5 * h, trial, k2, rotor, bearings, magnets, levitated, frozen, entry, seen)
            for i in range(s.size):
                trial[i] = s[i] + 0.5 * h * k2[i]
            _rates(t + 0.5 * h, trial, k3, rotor, bearings, magnets, levitated, frozen, entry, seen)
            for i in range(s.size):
                trial[i] = s[i] + h * k3[i]
            _rates(t + h, trial, k4, rotor, bearings, magnets, levitated, frozen, entry, seen)
            for i in range(s.size):
                s[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
    return places, turning, force, s


@njit(cache=True)
def settle_ring(b: Bearing, ring_angle: float, cage_angle: float) -> tuple[float, float]:
    """Return where the ring rests on its balls under its own weight, the outer ring at zero."""
    x, y = 0.0, 0.0
    give = 1.0 / (b.ball_stiffness * b.balls * 0.01)  # softer than the stiffest ball row met here
    for _ in range(20000):
        fx, fy = _ball_force(b, x, y, ring_angle, cage_angle)
        fy -= b.ring_mass * GRAVITY
        step = min(give, 2e-7 / max(np.sqrt(fx * fx + fy * fy), 1e-12))
        x, y = x + step * fx, y + step * fy
    return x, y
