"""Error of the rigid line through the probes for a shaft that bends: under its weight, in an impact, by its unbalance.

The bearing forces act in their planes, the rotor's mass is distributed between and beyond them: the shaft bends, and the straight
line through the probe planes misses its centre at the bearing planes by some micrometres at rest, and by ten times as much in
an impact of ten times the load.

In levitation the magnetic bearings carry the weight, and the shaft sags between them.  Its unbalance bends it too, once per
revolution: a bending mode of the free rotor with angular frequency w_k responds by u_k w^2 / (w_k^2 - w^2), where the rigid
modes respond to their own share u of the unbalance by -u.  The distribution of the unbalance along the shaft is not known; its
share in the bending modes is taken to be as large as that in the rigid ones, in coordinates of unit modal mass, as for a single
point mass.  A rotor balanced only as a rigid one may have more.
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

BENDS = "shaft bending between probe and bearing"  # remark on an interval that includes this
DRAWN = 1.2  # factor on deflections by the drawing: shrunk-on parts, shear and higher modes change them by some tenths
_BENDING = 12  # free-free bending modes summed for the shaft's flexibility
_LIGHTEST, _HEAVIEST = 1e-9, 1000.0  # multiples of the static load: no drop exceeds the latter
_NEAREST = 0.1  # least |1 - (w / w_k)^2|: a bending frequency from a drawing, without gyroscopics, is right to 5 %


@dataclass(frozen=True)
class LevitatedMiss:
    """Possible error of the rigid line at an end in levitation, m: from the sag, and in the once-per-revolution orbit."""

    sag: float = 0.0
    once: float = 0.0


def line_beyond(
    planes: xr.Dataset, machine: Machine, rotor: RotorModel, loads: Sequence[tuple[float, float]]
) -> dict[str, float]:
    """Return how far the rigid line lies below the bent shaft at each end, m, for supporting `loads` (position, m, and force, N).

    Zero for an end that is not evaluated along the line.
    """
    modes = free_free(rotor, _BENDING)
    positions, forces = (np.array(column) for column in zip(*loads, strict=True))
    bent = (2 * np.pi * modes.frequencies[2:]) ** -2 * (modes.at(positions)[:, 2:].T @ forces)
    below = _missed(planes, machine, modes)[:, 1, 1] @ bent
    return dict(zip(machine.ends, below.tolist(), strict=True))


def at_rest(machine: Machine, loads: Mapping[str, float]) -> list[tuple[float, float]]:
    """Return the position, m, and load, N, of each touchdown bearing at rest."""
    return [(machine.bearing(end).position, load) for end, load in loads.items()]


def levitated(machine: Machine, rotor: RotorModel) -> list[tuple[float, float]]:
    """Return the position, m, and static load, N, of each magnetic bearing, or of each touchdown bearing.

    Touchdown bearings stand in if magnetic bearings at fewer than two positions are given; more than two share the load
    according to their stiffness.
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
    """Return the possible error of the line at each end of the levitated shaft with once-per-revolution orbits `once`, m."""
    sags = line_beyond(planes, machine, rotor, levitated(machine, rotor))
    shares = _bent_once(planes, machine, rotor, speed_hz or 0.0)
    orbit = float(np.linalg.norm(once)) if len(once) else 0.0
    return {end: LevitatedMiss(DRAWN * abs(sags[end]), shares[end] * orbit) for end in machine.ends}


def _bent_once(planes: xr.Dataset, machine: Machine, rotor: RotorModel, speed_hz: float) -> dict[str, float]:
    """Return the error of the line in the once-per-revolution orbit of each end, relative to the orbits of both ends.

    Their size is the root of the sum of both ends' and axes' squared amplitudes.  Zero for an end not evaluated along the line.
    """
    modes = free_free(rotor, _BENDING)
    ratio = (speed_hz / modes.frequencies[2:]) ** 2
    amplitude = ratio / np.maximum(np.abs(1 - ratio), _NEAREST)
    rigid = np.linalg.inv(modes.at([machine.bearing(end).position for end in machine.ends])[:, :2])
    misses = np.linalg.norm(_missed(planes, machine, modes), ord=2, axis=(1, 2))  # (end, mode)
    shares = np.linalg.norm(misses * amplitude, axis=1) * np.linalg.norm(rigid, ord=2)
    return dict(zip(machine.ends, shares.tolist(), strict=True))


def relative_load(bearing: TouchdownBearing, load: float, travel: float) -> float:
    """Return the multiple of the static load, N, under which contact, balls and support of a bearing deflect by `travel`, m."""
    from scipy.optimize import brentq

    def beyond(times: float) -> float:
        return total_travel(bearing, times * load) - travel

    if beyond(_LIGHTEST) >= 0:
        return 0.0
    return float(brentq(beyond, _LIGHTEST, _HEAVIEST, xtol=1e-9)) if beyond(_HEAVIEST) > 0 else _HEAVIEST


def _missed(planes: xr.Dataset, machine: Machine, modes: Modes) -> np.ndarray:
    """Return the error of the line for each bending mode of unit amplitude: (end, axis of the line, axis of the mode, mode)."""
    ends = list(machine.ends)
    missed = np.zeros((len(ends), 2, 2, modes.n - 2))
    if "weights" not in planes:  # not computed from probes
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
