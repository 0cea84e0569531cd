"""The signal of an effect in a record beyond what calibration can take up, in standard deviations of the noise.

The change of the probes' readings by the effect, from shortly before the release to 30 ms after it, less what calibrated values
and each drop's own start can explain within their priors, is compared with the noise.  Effects that act later (drag of a ring,
heat, windage) show more than this number says.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from tests.blind.case import Case
from tests.blind.hidden import ENDS, World
from tests.blind.machine import Known
from tests.blind.sensors import read
from tests.blind.truth import RATE, Array, Start, rotor_modes, run

BEFORE, AFTER = 100, 600  # samples


def projected_signal(case: Case, drops: tuple[int, ...] = (0, 2)) -> float:
    """Return the signal of a case's hidden effects over some of its drops; 0 if nothing is hidden."""
    if not case.hidden:
        return 0.0
    changes, shared, own = [], [], []
    for k in drops:
        start = case.starts[k]
        plain = _seen(case.plain, start, 0.0)
        changes.append(_seen(case.world, start, case.world.marks[k]) - plain)
        shared.append([(_seen(w, start, 0.0) - plain) * known for w, known in _calibratable(case.plain)])
        own.append([(_seen(case.plain, other, 0.0) - plain) * known for other, known in _starts(case, start)])
        own[-1] += [(_seen(w, start, 0.0) - plain) * known for w, known in _pushed(case.plain)]
        own[-1].append(_later(plain))
    # a column is the change by one prior standard deviation of a value
    design = np.hstack(
        [np.vstack([np.array(each).T for each in shared]), block_diag(*(np.array(each).T for each in own))]
    )
    noise = case.plain.sensors.noise
    design = np.vstack([design / noise, np.eye(design.shape[1])])
    change = np.concatenate([*changes, np.zeros(design.shape[1])])
    change /= noise
    left = change - design @ np.linalg.lstsq(design, change, rcond=None)[0]
    return float(np.linalg.norm(left))


def _seen(world: World, start: Start, mark: float) -> Array:
    """The noiseless readings, flattened."""
    drop = run(world.truth, start, samples=BEFORE + AFTER, levitated=BEFORE)
    silent = replace(world.sensors, noise=0.0, hum=0.0)
    channels = read(drop, world.truth.machine, silent, mark, np.random.default_rng(0), levitated=BEFORE, rounded=False)
    return channels.probes.ravel()


def _later(seen: Array) -> Array:
    """The change by a later release, by its prior standard deviation of 2 ms."""
    readings = seen.reshape(BEFORE + AFTER, -1)
    change = np.zeros_like(readings)
    change[BEFORE:-1] = (readings[BEFORE + 1 :] - readings[BEFORE:-1]) * 2e-3 * RATE
    later: Array = change.ravel()
    return later


def _calibratable(world: World) -> Iterator[tuple[World, float]]:
    """The world with each calibrated value in turn a little off, and the factor that makes the change one standard deviation.

    Half a tolerance is read as a standard deviation.
    """
    truth, machine = world.truth, world.truth.machine
    small = 1e-3  # of a standard deviation
    for e, t in enumerate(machine.touchdowns):
        for name, known in (
            ("gap", t.gap),
            ("support_stiffness", t.support_stiffness),
            ("support_damping", t.support_damping),
            ("ball_clearance", t.ball_clearance),
            ("ring_drag", t.ring_drag),
        ):
            bearings = list(truth.bearings)
            bearings[e] = bearings[e]._replace(**{name: getattr(bearings[e], name) + small * _deviation(known)})
            yield replace(world, truth=replace(truth, bearings=(bearings[0], bearings[1]))), 1 / small
        at = (small, 0.0) if e == 0 else (0.0, small)
        k, c = truth.magnet_stiffness, truth.magnet_damping
        by = _deviation(machine.magnets[e].stiffness), _deviation(machine.magnets[e].damping)
        stiffer, slower = (k[0] + at[0] * by[0], k[1] + at[1] * by[0]), (c[0] + at[0] * by[1], c[1] + at[1] * by[1])
        yield replace(world, truth=replace(truth, magnet_stiffness=stiffer)), 1 / small
        yield replace(world, truth=replace(truth, magnet_damping=slower)), 1 / small
    both = machine.touchdowns[0]  # the same at both ends
    for name, known in (("friction", both.friction), ("contact_damping", both.contact_damping)):
        one, two = (b._replace(**{name: getattr(b, name) + small * _deviation(known)}) for b in truth.bearings)
        yield replace(world, truth=replace(truth, bearings=(one, two))), 1 / small
    for index, plane in enumerate(machine.planes):
        for step in (_deviation(plane.amount), 1j * plane.amount.nominal * plane.phase.margin / 2):
            moved = tuple(u + small * step if j == index else u for j, u in enumerate(truth.unbalance))
            yield replace(world, truth=replace(truth, unbalance=moved)), 1 / small
    for end in range(len(ENDS)):  # 1X and 2X runout of a good surface
        for order, usual in enumerate((1.5e-6, 0.75e-6)):
            for turn in (1, 1j):
                runout = [list(r) for r in world.sensors.runout]
                runout[end][order] += small * usual * turn
                changed = tuple((r[0], r[1], r[2]) for r in runout)
                yield replace(world, sensors=replace(world.sensors, runout=changed)), 1 / small


def _deviation(known: Known) -> float:
    return (abs(known.nominal) * known.percent / 100 + known.margin) / 2


def _starts(case: Case, start: Start) -> Iterator[tuple[Start, float]]:
    """The start a little off: the set-point (known to 20 um), and the cage angles, which no record shows."""
    for e in range(2):
        for turn in (1, 1j):
            moved = list(start.set_point)
            moved[e] += 1e-9 * turn
            yield replace(start, set_point=(moved[0], moved[1])), 20e-6 / 1e-9
        cage = list(start.cage_angle)
        cage[e] += 1e-4
        yield replace(start, cage_angle=(cage[0], cage[1])), 0.3 / 1e-4


def _pushed(world: World) -> Iterator[tuple[World, float]]:
    """The world with a small impulse at the release: velocities of some 0.5 mm/s beyond the whirl."""
    impulse = 0.5e-3 * rotor_modes(world.truth).mass / 2
    length = 2e-4
    for magnet in range(2):
        for turn in (1, 1j):
            force = 1e-3 * impulse * np.pi / (2 * length)
            blow = replace(
                world.truth, kick_magnet=magnet, kick_force=force * turn, kick_time=BEFORE / RATE, kick_length=length
            )
            yield replace(world, truth=blow), 1e3
