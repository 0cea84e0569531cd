"""The equations of a drop written a second time, in plain NumPy with complex displacements x + i y: an independent reference.

Nothing here comes from the simulator but the rotor's modes.
"""

from __future__ import annotations

import numpy as np
from tdbsim.modes import free_free
from tdbsim.rotor import build_rotor

BENDING = 4  # modes a plane: equations are compared, and many modes take an explicit integrator long


class PlainDrop:
    """State: real view of [modes p, their rates; a row an end: ring z, support z, rates], shaft and ring angles, speeds."""

    def __init__(self, machine, speed_hz, bending=BENDING, cage_angle=(0.0, 0.0)):
        self.machine = machine
        model = build_rotor(machine)
        self.modes = free_free(model, bending, [b.position for b in machine.touchdown_bearings])
        self.n = self.modes.n
        self.shape = self.modes.at([b.position for b in machine.touchdown_bearings])
        self.unbalance = sum(
            self.modes.at(u.position) * u.amount.nominal * np.exp(1j * u.phase.nominal) for u in machine.rotor.unbalance
        )
        ones = np.tile([1.0, 0.0], len(model.nodes))
        self.weight = -1j * machine.gravity * (self.modes.vectors.T @ model.plane_mass @ ones)
        self.square = (2 * np.pi * self.modes.frequencies) ** 2
        self.damping = 2 * machine.rotor.modal_damping_ratio * np.sqrt(self.square)
        self.gyro = self.modes.gyro
        self.inertia = model.polar_inertia
        self.omega0 = machine.sense * 2 * np.pi * speed_hz
        bearings = machine.touchdown_bearings

        def column(f):
            return np.array([f(b) for b in bearings], dtype=float)

        self.gap = column(lambda b: b.radial_gap.nominal)
        self.radius = column(lambda b: b.journal_radius)
        self.exponent = column(lambda b: b.contact_exponent)
        # every exponent has the same force at 10 um
        self.contact = column(lambda b: b.contact_stiffness) * 1e-5 ** (10 / 9 - self.exponent)
        self.loss = column(lambda b: b.contact_damping.nominal)
        self.mu = column(lambda b: b.friction.nominal)
        self.mu_falls = column(lambda b: b.friction_load_exponent)
        self.rotor_weight = 9.80665 * model.total_mass
        self.ring_mass = column(lambda b: b.inner_ring_mass)
        self.ring_inertia = column(lambda b: b.inner_ring_inertia)
        self.drag = column(lambda b: b.inner_ring_drag.nominal)
        self.ball_damping = column(lambda b: b.ball_damping.nominal)
        self.ball_stiffness = column(lambda b: b.ball_stiffness)
        self.clearance = column(lambda b: b.balls.diametral_clearance.nominal)
        self.cage_ratio = column(
            lambda b: (1 - b.balls.diameter / b.balls.pitch_diameter * np.cos(b.balls.contact_angle)) / 2
        )
        self.support = [
            (b.support_mass, b.support_stiffness.nominal, b.support_damping.nominal) for b in machine.touchdown_bearings
        ]
        self.support_mass, self.support_stiffness, self.support_damping = np.array(self.support).T
        self.balls = [np.exp(2j * np.pi * np.arange(b.balls.count) / b.balls.count) for b in bearings]
        self.cage_angle = np.array(cage_angle)
        self.decay = 0.0 if machine.rotor.speed_decay_time is None else 1 / machine.rotor.speed_decay_time.nominal

    def pack(self, p, dp, ring, support, dring, dsupport, angles, speeds):
        return np.concatenate([np.concatenate([p, dp, ring, support, dring, dsupport]).view(float), angles, speeds])

    def unpack(self, y):
        n = self.n
        z = y[:-6].view(complex)
        return z[:n], z[n : 2 * n], *z[2 * n :].reshape(4, 2), y[-6:-3], y[-3:]

    def ball_force(self, offset, ring_angle):
        force = np.zeros(2, dtype=complex)
        for end in range(2):
            direction = self.balls[end] * np.exp(1j * (self.cage_angle[end] + self.cage_ratio[end] * ring_angle[end]))
            press = np.maximum((offset[end] * direction.conj()).real - self.clearance[end] / 2, 0.0)
            force[end] = -np.sum(self.ball_stiffness[end] * press**1.5 * direction)
        return force

    def __call__(self, t, y):
        p, dp, ring, support, dring, dsupport, angles, speeds = self.unpack(y)
        omega, ring_speed = speeds[0], speeds[1:]
        offset, rate = self.shape @ p - ring, self.shape @ dp - dring
        distance = np.abs(offset)
        normal = np.where(distance > 0, offset / np.where(distance > 0, distance, 1), 1)
        depth = np.maximum(distance - self.gap, 0.0)
        push = self.contact * depth**self.exponent * (1 + 1.5 * self.loss * (rate * normal.conj()).real)
        push = np.maximum(push, 0.0)
        tangent = 1j * normal
        slip = omega * self.radius - ring_speed * (self.radius + self.gap) + (rate * tangent.conj()).real
        mu = self.mu * np.where(push > 0, push / self.rotor_weight, 1.0) ** -self.mu_falls
        rub = -mu * push * slip / np.hypot(slip, 0.05)
        force = -push * normal + rub * tangent

        struck = np.sum(rub * self.radius) / self.inertia
        alpha = struck - omega * self.decay
        spin = np.exp(1j * angles[0])
        ddp = (
            self.shape.T @ force
            + self.weight
            - self.damping * dp
            - self.square * p
            + 1j * self.gyro @ (omega * dp + struck * p)
            + self.unbalance * (omega**2 - 1j * alpha) * spin
        )
        balls = self.ball_force(ring - support, angles[1:]) + self.ball_damping * (dsupport - dring)
        ddring = (balls - force) / self.ring_mass - 1j * self.machine.gravity
        ddsupport = (-balls - self.support_stiffness * support - self.support_damping * dsupport) / self.support_mass
        ring_torque = -rub * (self.radius + self.gap) - self.drag * ring_speed / np.hypot(ring_speed, 1.0)
        return self.pack(
            dp, ddp, dring, dsupport, ddring, ddsupport, speeds, np.array([alpha, *(ring_torque / self.ring_inertia)])
        )

    def from_state(self, state):
        """Turn a state of the simulator (positions, rates, ...) into one of this model."""
        n, nq = self.n, 2 * self.n + 15
        q, v = state[:nq], state[nq : 2 * nq]
        at = 2 * n + 6 * np.arange(2)
        return self.pack(
            q[:n] + 1j * q[n : 2 * n], v[:n] + 1j * v[n : 2 * n], q[at] + 1j * q[at + 1], q[at + 2] + 1j * q[at + 3],
            v[at] + 1j * v[at + 1], v[at + 2] + 1j * v[at + 3], q[2 * n + 12 :], v[2 * n + 12 :],
        )  # fmt: skip

    def at_ends(self, y):
        """Return the shaft's centre (2, k), complex, at the touchdown bearings for states (size, k)."""
        return np.array([self.shape @ self.unpack(np.ascontiguousarray(column))[0] for column in y.T]).T
