"""Characteristic orders of a touchdown bearing whose inner ring turns with the shaft.

Each of N balls passes a point of the outer race once per turn of the cage, and a point of the inner race once per turn of the
ring relative to the cage (T. A. Harris, Rolling Bearing Analysis); `tdbsim.ball_motion` gives the speeds of cage and balls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tdbsim.ball_motion import ball_motion
from tdbsim.machine import Machine, TouchdownBearing

from tdbmon.analysis.lines import Line

_NEAR = 0.01  # relative tolerance: the ring turns slightly slower than the shaft that rolls in it


def bearing_orders(bearing: TouchdownBearing) -> dict[str, float]:
    """Return the characteristic orders by name: "cage", "ball pass outer", "ball pass inner", "ball spin"."""
    count, motion = bearing.balls.count, ball_motion(bearing.geometry)
    return {
        "cage": motion.cage,
        "ball pass outer": count * motion.cage,
        "ball pass inner": count * motion.ring,
        "ball spin": motion.roll,
    }


def name_bearing_orders(lines: Sequence[Line], machine: Machine) -> tuple[Line, ...]:
    """Name order lines within 1 % of a characteristic order of a touchdown bearing, except multiples of one half."""
    out = []
    for line in lines:
        if line.kind == "order" and line.order is not None and abs(2 * line.order - round(2 * line.order)) > 0.02:
            for bearing in machine.touchdown_bearings:
                for name, order in bearing_orders(bearing).items():
                    if abs(line.order / order - 1) < _NEAR and name not in line.name:
                        line = replace(line, name=f"{line.name} {name}")
        out.append(line)
    return tuple(out)
