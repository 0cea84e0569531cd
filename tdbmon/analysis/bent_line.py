"""How far the rigid line through the probes misses a shaft that its touchdown bearings bend.

The bearings push at their planes, the rotor's mass lies between and beyond them: the shaft bends, and the straight line through
the probe planes passes the bearing planes by some micrometres at rest, and by ten times as much in a blow of ten times the load.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, TouchdownBearing
from tdbsim.modes import free_free
from tdbsim.rotor import RotorModel

from tdbmon.analysis.rest import rest_travel

_BENDING = 12  # free-free bending modes, whose flexibility bends the shaft
_HEAVIEST = 1000.0  # loads at rest: no drop presses with more


def line_beyond(
    planes: xr.Dataset, machine: Machine, rotor: RotorModel, loads: Mapping[str, float]
) -> dict[str, float]:
    """Return by how much the line lies below the shaft at each end, m, where both ends carry their loads at rest, N.

    Nought of an end that is not taken along the line.
    """
    beyond = dict.fromkeys(machine.ends, 0.0)
    if "weights" not in planes:  # not made from probes
        return beyond
    modes = free_free(rotor, _BENDING)
    flexibility = (2 * np.pi * modes.frequencies[2:]) ** -2
    at_ends = modes.at([machine.bearing(end).position for end in machine.ends])[:, 2:]
    bent = flexibility * (at_ends.T @ np.array([loads[end] for end in machine.ends]))
    used = {probe.name: probe for probe in machine.probes}
    probes = [used[str(name)] for name in planes.probe.values]
    readings = modes.at([probe.position for probe in probes])[:, 2:] @ bent * np.sin([probe.angle for probe in probes])
    for end, shaft in zip(machine.ends, (at_ends @ bent).tolist(), strict=True):
        if str(planes.plane.sel(end=end).item()) == "bearing":
            line = float(planes.weights.sel(end=end, axis="y").to_numpy() @ readings)
            beyond[end] = shaft - line
    return beyond


def relative_load(bearing: TouchdownBearing, load: float, travel: float) -> float:
    """Return how many times the load at rest, N, makes contact, balls and support of a bearing yield by a travel, m."""
    low, high = 0.0, _HEAVIEST
    for _ in range(40):
        middle = 0.5 * (low + high)
        less = rest_travel(bearing, middle * load).total < travel
        low, high = (middle, high) if less else (low, middle)
    return high
