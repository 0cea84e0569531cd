"""Orders of rotation at which a touchdown bearing speaks, once its inner ring turns with the shaft.

With balls of diameter d on a pitch circle D and no contact angle the cage turns at (1 - d/D)/2 of the ring's speed; the
balls pass a point of the outer race N times as often, a point of the inner race N (1 + d/D)/2 times a revolution, and a
ball turns (D/d)(1 - (d/D)^2)/2 times (T. A. Harris, Rolling Bearing Analysis, kinematics of pure rolling).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tdbsim.machine import Machine, TouchdownBearing

from tdbmon.analysis.lines import Line

_NEAR = 0.01  # relative: the ring runs a little slower than the shaft that rolls in it


def bearing_orders(bearing: TouchdownBearing) -> dict[str, float]:
    """Return the orders by name: "cage", "ball pass outer", "ball pass inner", "ball spin"."""
    balls = bearing.balls
    ratio = balls.diameter / balls.pitch_diameter
    return {
        "cage": (1 - ratio) / 2,
        "ball pass outer": balls.count * (1 - ratio) / 2,
        "ball pass inner": balls.count * (1 + ratio) / 2,
        "ball spin": (1 / ratio - ratio) / 2,
    }


def name_bearing_orders(lines: Sequence[Line], machine: Machine) -> tuple[Line, ...]:
    """Name the order lines that are no simple fraction and lie within 1 % of an order of a touchdown bearing."""
    out = []
    for line in lines:
        if line.kind == "order" and line.order is not None and abs(2 * line.order - round(2 * line.order)) > 0.02:
            for bearing in machine.touchdown_bearings:
                for name, order in bearing_orders(bearing).items():
                    if abs(line.order / order - 1) < _NEAR and name not in line.name:
                        line = replace(line, name=f"{line.name} {name}")
        out.append(line)
    return tuple(out)
