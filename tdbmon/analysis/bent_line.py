"""How far the rigid line through the probes misses a shaft that bends: under its weight, in a blow, by its unbalance.

The bearings push at their planes, the rotor's mass lies between and beyond them: the shaft bends, and the straight line through
the probe planes passes the bearing planes by some micrometres at rest, and by ten times as much in a blow of ten times the load.

Levitated, the weight hangs in the magnetic bearings, and the shaft sags between them.  Its unbalance bends it too, once per
revolution: in a bending mode of the free rotor, of the angular frequency w_k, by u_k w^2 / (w_k^2 - w^2), where the rigid modes
follow their own share u of the unbalance by -u.  How the unbalance lies along the shaft is not known; that in the bending modes
is taken to be as large as that in the rigid ones, in coordinates of unit modal mass, as a single lump makes it.  A rotor that
was balanced as a rigid one alone may keep more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, TouchdownBearing
from tdbsim.modes import Modes, free_free
from tdbsim.rotor import RotorModel, static_loads

from tdbmon.analysis.rest import total_travel

BENDS = "what the shaft bends between probe and bearing"  # of an interval that holds it
DRAWN = 1.2  # times what the drawing tells: parts shrunk on, shear and higher modes make a rotor bend more or less by some tenths
_BENDING = 12  # free-free bending modes, whose flexibility bends the shaft
_LIGHTEST, _HEAVIEST = 1e-9, 1000.0  # loads at rest: no drop presses with more
_NEAREST = 0.1  # of 1 - (w / w_k)^2: by a drawing, and without gyroscopics, a bending frequency is right to 5 %


@dataclass(frozen=True)
class LevitatedMiss:
    """By how much the line may miss the levitated shaft at an end, m: by its sag, and by its orbit once per revolution."""

    sag: float = 0.0
    once: float = 0.0


def line_beyond(
    planes: xr.Dataset, machine: Machine, rotor: RotorModel, loads: Sequence[tuple[float, float]]
) -> dict[str, float]:
    """Return by how much the line lies below the shaft at each end, m, where loads, N, hold it up at some positions, m.

    Nought of an end that is not taken along the line.
    """
    modes = free_free(rotor, _BENDING)
    positions, forces = (np.array(column) for column in zip(*loads, strict=True))
    bent = (2 * np.pi * modes.frequencies[2:]) ** -2 * (modes.at(positions)[:, 2:].T @ forces)
    below = _missed(planes, machine, modes)[:, 1, 1] @ bent
    return dict(zip(machine.ends, below.tolist(), strict=True))


def at_rest(machine: Machine, loads: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return where the touchdown bearings hold the shaft up, m, and with what, N."""
    return [(machine.bearing(end).position, load) for end, load in loads.items()]


def levitated(machine: Machine, rotor: RotorModel) -> list[tuple[float, float]]:
    """Return where the magnetic bearings hold the shaft up, m, and with what, N: the touchdown bearings where none are stated.

    More than two share the load by their stiffness.
    """
    positions = np.array([magnet.position for magnet in machine.magnetic_bearings])
    if len(set(positions.tolist())) < 2:
        return at_rest(machine, static_loads(machine, rotor))
    levers = np.array([np.ones_like(positions), positions - rotor.centre_of_mass])
    shared = levers * [magnet.stiffness.nominal for magnet in machine.magnetic_bearings]
    forces = shared.T @ np.linalg.solve(shared @ levers.T, [rotor.total_mass * machine.gravity, 0.0])
    return list(zip(positions.tolist(), forces.tolist(), strict=True))


def levitated_misses(
    planes: xr.Dataset, machine: Machine, rotor: RotorModel, speed_hz: float | None, once: Sequence[float]
) -> dict[str, LevitatedMiss]:
    """Return by how much the line may miss the levitated shaft at each end, that turns on orbits `once` at the ends, m."""
    sags = line_beyond(planes, machine, rotor, levitated(machine, rotor))
    shares = _bent_once(planes, machine, rotor, speed_hz or 0.0)
    orbit = float(np.linalg.norm(once)) if len(once) else 0.0
    return {end: LevitatedMiss(DRAWN * abs(sags[end]), shares[end] * orbit) for end in machine.ends}


def _bent_once(planes: xr.Dataset, machine: Machine, rotor: RotorModel, speed_hz: float) -> dict[str, float]:
    """Return by how much the line may miss the orbit once per revolution at each end, over the orbits of both ends.

    Those count as the root of the sum of both ends' and axes' squared amplitudes.  Nought of an end not taken along the line.
    """
    modes = free_free(rotor, _BENDING)
    ratio = (speed_hz / modes.frequencies[2:]) ** 2
    amplitude = ratio / np.maximum(np.abs(1 - ratio), _NEAREST)
    rigid = np.linalg.inv(modes.at([machine.bearing(end).position for end in machine.ends])[:, :2])
    misses = np.linalg.norm(_missed(planes, machine, modes), ord=2, axis=(1, 2))  # (end, mode)
    shares = np.linalg.norm(misses * amplitude, axis=1) * np.linalg.norm(rigid, ord=2)
    return dict(zip(machine.ends, shares.tolist(), strict=True))


def relative_load(bearing: TouchdownBearing, load: float, travel: float) -> float:
    """Return how many times the load at rest, N, makes contact, balls and support of a bearing yield by a travel, m."""
    from scipy.optimize import brentq

    def beyond(times: float) -> float:
        return total_travel(bearing, times * load) - travel

    if beyond(_LIGHTEST) >= 0:
        return 0.0
    return float(brentq(beyond, _LIGHTEST, _HEAVIEST, xtol=1e-9)) if beyond(_HEAVIEST) > 0 else _HEAVIEST


def _missed(planes: xr.Dataset, machine: Machine, modes: Modes) -> np.ndarray:
    """Return by how much the line misses each bending mode of unit size: (end, axis of the line, axis of the mode, mode)."""
    ends = list(machine.ends)
    missed = np.zeros((len(ends), 2, 2, modes.n - 2))
    if "weights" not in planes:  # not made from probes
        return missed
    used = {probe.name: probe for probe in machine.probes}
    probes = [used[str(name)] for name in planes.probe.values]
    angles = np.array([probe.angle for probe in probes])
    shapes = modes.at([probe.position for probe in probes])[:, 2:]
    at_ends = modes.at([machine.bearing(end).position for end in ends])[:, 2:]
    for i, end in enumerate(ends):
        if str(planes.plane.sel(end=end).item()) == "bearing":
            weights = planes.weights.sel(end=end).to_numpy()
            line = np.einsum("ap,bp,pk->abk", weights, [np.cos(angles), np.sin(angles)], shapes)
            missed[i] = np.eye(2)[:, :, None] * at_ends[i] - line
    return missed
