"""How much of an effect a record shows beyond what calibration can take up, in standard deviations of the noise.

The change that the effect makes to the probes, from shortly before the release to 30 ms after it, is projected off the
changes that the calibratable values and each drop's own start make; what is left is compared with the noise.  Effects
that act later (a ring that drags, heat) show more than this number says.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.blind.case import Case
from tests.blind.hidden import ENDS, World
from tests.blind.sensors import read
from tests.blind.truth import Array, Start, run

BEFORE, AFTER = 100, 600  # samples


def projected_signal(case: Case, drops: tuple[int, ...] = (0, 2)) -> float:
    """Return the signal of what is hidden in a case over some of its drops; 0 where nothing is hidden."""
    if not case.hidden:
        return 0.0
    changes, columns = [], []
    for k in drops:
        start = case.starts[k]
        plain = _seen(case.plain, start, 0.0)
        changes.append(_seen(case.world, start, case.world.marks[k]) - plain)
        shared = [(_seen(world, start, 0.0) - plain) / size for world, size in _calibratable(case.plain)]
        own = [(_seen(case.plain, other, 0.0) - plain) / size for other, size in _starts(case, start)]
        own += [(_seen(world, start, 0.0) - plain) / size for world, size in _pushed(case.plain)]
        own.append(_later(plain))
        columns.append((np.array(shared), np.array(own)))
    own_count = len(columns[0][1])
    design = np.vstack(
        [
            np.hstack(
                [shared.T, *(own.T if j == k else np.zeros((shared.shape[1], own_count)) for j in range(len(drops)))]
            )
            for k, (shared, own) in enumerate(columns)
        ]
    )
    design /= np.linalg.norm(design, axis=0)
    change = np.concatenate(changes)
    left = change - design @ np.linalg.lstsq(design, change, rcond=1e-9)[0]
    return float(np.linalg.norm(left) / case.plain.sensors.noise)


def _seen(world: World, start: Start, mark: float) -> Array:
    """The noiseless readings, one after the other."""
    drop = run(world.truth, start, samples=BEFORE + AFTER, levitated=BEFORE)
    silent = replace(world.sensors, noise=0.0, hum=0.0)
    channels = read(drop, world.truth.machine, silent, mark, np.random.default_rng(0), levitated=BEFORE, rounded=False)
    return channels.probes.ravel()


def _later(seen: Array) -> Array:
    """What a slightly later release changes."""
    readings = seen.reshape(BEFORE + AFTER, -1)
    change = np.gradient(readings, axis=0)
    change[:BEFORE] = 0.0
    later: Array = change.ravel()
    return later


def _calibratable(world: World) -> Iterator[tuple[World, float]]:
    """The world with one value a little off, for each that a machine file leaves open."""
    truth = world.truth
    for e in range(len(ENDS)):
        for name in ("gap", "support_stiffness", "support_damping", "ball_clearance", "ring_drag"):
            size = 1e-4 * getattr(truth.bearings[e], name)
            bearings = list(truth.bearings)
            bearings[e] = bearings[e]._replace(**{name: getattr(bearings[e], name) + size})
            yield replace(world, truth=replace(truth, bearings=(bearings[0], bearings[1]))), size
        at = (1.0, 0.0) if e == 0 else (0.0, 1.0)
        k, c = truth.magnet_stiffness, truth.magnet_damping
        stiffer = (k[0] * (1 + 1e-3 * at[0]), k[1] * (1 + 1e-3 * at[1]))
        slower = (c[0] * (1 + 1e-3 * at[0]), c[1] * (1 + 1e-3 * at[1]))
        yield replace(world, truth=replace(truth, magnet_stiffness=stiffer)), 1e-3 * k[e]
        yield replace(world, truth=replace(truth, magnet_damping=slower)), 1e-3 * c[e]
    for name in ("friction", "contact_damping"):  # the same at both ends
        size = 1e-4 * getattr(truth.bearings[0], name)
        one, two = (b._replace(**{name: getattr(b, name) + size}) for b in truth.bearings)
        yield replace(world, truth=replace(truth, bearings=(one, two))), size
    for index, plane in enumerate(truth.machine.planes):
        for turn in (1, 1j):
            size = 1e-3 * plane.amount.nominal
            moved = tuple(u + size * turn if j == index else u for j, u in enumerate(truth.unbalance))
            yield replace(world, truth=replace(truth, unbalance=moved)), size
    for end in range(len(ENDS)):  # what the probes see of the surface, once and twice a turn
        for order in range(2):
            for turn in (1, 1j):
                runout = [list(r) for r in world.sensors.runout]
                runout[end][order] += 1e-8 * turn
                changed = tuple((r[0], r[1], r[2]) for r in runout)
                yield replace(world, sensors=replace(world.sensors, runout=changed)), 1e-8


def _starts(case: Case, start: Start) -> Iterator[tuple[Start, float]]:
    """The start a little off: the set-point, and the angles that no record tells."""
    for e in range(2):
        for turn in (1, 1j):
            moved = list(start.set_point)
            moved[e] += 1e-9 * turn
            yield replace(start, set_point=(moved[0], moved[1])), 1e-9
        cage = list(start.cage_angle)
        cage[e] += 1e-4
        yield replace(start, cage_angle=(cage[0], cage[1])), 1e-4


def _pushed(world: World) -> Iterator[tuple[World, float]]:
    """The world with a small blow at the release, for each velocity that a rotor may have then."""
    for magnet in range(2):
        for turn in (1, 1j):
            blow = replace(
                world.truth, kick_magnet=magnet, kick_force=1.0 * turn, kick_time=BEFORE / 20e3, kick_length=2e-4
            )
            yield replace(world, truth=blow), 1.0
