"""Axes for orbits at one end, as seen looking at the machine: x right, y up, equal scale, in µm."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle

from tdbmon.figures.style import AXIS_WORD, BLACK, GREY, PURPLE, UM, centre_of

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis

_SMALL = 0.25  # of the clearance circle: a smaller orbit is drawn magnified


def orbit_axes(ax: Axes) -> None:
    """Label the axes and set an equal scale."""
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel(f"{AXIS_WORD['x']} [µm]")
    ax.set_ylabel(f"{AXIS_WORD['y']} [µm]")


def show_about(ax: Axes, middle: np.ndarray | Sequence[float], reach: float) -> None:
    """Set the limits to `reach` on all sides of a point."""
    ax.set_xlim(middle[0] - reach, middle[0] + reach)
    ax.set_ylim(middle[1] - reach, middle[1] + reach)


def circle(ax: Axes, centre: np.ndarray | Sequence[float], radius: float, **look: Any) -> None:
    """Draw a circle, black and thin unless `look` says otherwise."""
    ax.add_patch(Circle((centre[0], centre[1]), radius, fill=False, **{"color": BLACK, "linewidth": 0.9, **look}))


def keyphasor_dots(ax: Axes, xy: np.ndarray) -> None:
    """Draw a dot at each shaft position, (2, k), of a keyphasor pulse."""
    ax.plot(*xy, "o", color=PURPLE, markersize=3, markeredgecolor="white", markeredgewidth=0.4, label="keyphasor")


def frame_orbit(ax: Axes, analysis: Analysis, end: str, xy: np.ndarray) -> bool:
    """Draw clearance circle and rotation arrow about an orbit and set the limits; return whether it is magnified."""
    gap = analysis.ends[end].gap
    centre = centre_of(analysis, end) * UM
    if gap is not None:
        radius, label = gap.size * UM, "clearance circle"
    else:
        radius, label = (
            analysis.machine.bearing(end).radial_gap.nominal * UM,
            "gap of the drawing about the probes' zero",
        )
    circle(ax, centre, radius, label=label)
    ax.plot(*centre, "+", color=BLACK, markersize=5)
    low, high = np.nanmin(xy, axis=1), np.nanmax(xy, axis=1)
    size = float(np.max(high - low))
    magnified = size < _SMALL * 2 * radius
    if magnified:
        middle, reach = (low + high) / 2, max(0.7 * size, 1e-3)
    else:
        middle, reach = centre, max(1.12 * radius, 1.05 * float(np.nanmax(np.abs(xy - centre[:, None]))))
    show_about(ax, middle, reach)
    rotation_arrow(ax, analysis.machine.sense, middle, reach)
    return magnified


def rotation_arrow(ax: Axes, sense: int, middle: np.ndarray | Sequence[float], reach: float) -> None:
    """Draw an arc with an arrowhead in the upper right, in the sense of rotation."""
    at, radius = np.asarray(middle) + 0.72 * reach, 0.16 * reach
    ax.add_patch(Arc((at[0], at[1]), 2 * radius, 2 * radius, theta1=-60, theta2=200, color=GREY, linewidth=1.1))
    tip = np.deg2rad(200.0 if sense > 0 else -60.0)
    point = at + radius * np.array([np.cos(tip), np.sin(tip)])
    along = sense * np.array([-np.sin(tip), np.cos(tip)])
    ax.annotate(
        "", tuple(point + 0.35 * radius * along), tuple(point - 0.05 * radius * along),
        arrowprops={
            "arrowstyle": "-|>", "color": GREY, "linewidth": 1.1, "mutation_scale": 7, "shrinkA": 0, "shrinkB": 0,
        },
    )  # fmt: skip
