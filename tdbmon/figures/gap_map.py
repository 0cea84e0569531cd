"""The gap map: settled positions, the clearance circle fitted to them, and how far they lie off it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from tdbsim.errors import InputError

from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    UM,
    Margins,
    centre_of,
    circled_ends,
    legend_below,
    new_figure,
    said,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis

_BIN_DEG = 2.0
MIDDLE = 0.99  # of the residuals, which the strip's scale holds: a few far off made the others a line


@styled
def gap_map(analysis: Analysis) -> Figure:
    """Draw the clearance circle of each end that has one, and below it the settled radius over the angle.

    Raises
    ------
    InputError
        If no clearance circle is known.
    """
    ends = circled_ends(analysis)
    if not ends:
        raise InputError("no clearance circle is known at any end")
    figure = new_figure(142, said(analysis, "settled positions only, thinned", "not filtered"))
    axes = subplots(figure, 2, len(ends), Margins(16, 3, 11, 24, across=18, down=13), height_ratios=[1.9, 1])
    for column, end in enumerate(ends):
        _plan(axes[0, column], analysis, end)
        _strip(axes[1, column], analysis, end)
    legend_below(figure)
    return figure


def _plan(ax: Axes, analysis: Analysis, end: str) -> None:
    ax.set_title(f"{end}: clearance circle")
    ax.set_xlabel("x (right) [µm]")
    ax.set_ylabel("y (up) [µm]")
    ax.set_aspect("equal", adjustable="box")
    gap, centre = analysis.ends[end].gap, centre_of(analysis, end) * UM
    if gap is None or gap.radius.value is None:
        return
    radius = gap.radius.value * UM
    ax.plot(*(gap.points.T * UM), ".", markersize=1.5, color=BLUE, rasterized=True, label="settled positions")
    ax.add_patch(
        Circle(tuple(centre), radius, fill=False, color=BLACK, linewidth=1.0, label="fitted circle, radius at rest")
    )
    if gap.radius.low is not None and gap.radius.high is not None:
        for limit in (gap.radius.low, gap.radius.high):
            ax.add_patch(
                Circle(tuple(centre), limit * UM, fill=False, color=BLACK, linewidth=0.5, linestyle=(0, (4, 2)))
            )
    air, drawing = analysis.ends[end].air_gap.value, analysis.machine.bearing(end).radial_gap.nominal
    if air is not None:
        ax.add_patch(Circle(tuple(centre), air * UM, fill=False, color=GREEN, linewidth=1.0, label="air gap"))
    dotted = (0, (1, 1))
    ax.add_patch(
        Circle(tuple(centre), drawing * UM, fill=False, color=ORANGE, linestyle=dotted, label="gap on the drawing")
    )
    ax.plot(*centre, "+", color=BLACK, markersize=8, label="centre")
    rest = np.nanmean(gap.points[-max(1, len(gap.points) // 10) :], axis=0) * UM
    ax.plot(
        *rest,
        "o",
        color=PURPLE,
        markersize=4,
        markerfacecolor="none",
        markeredgewidth=1.2,
        label="mean of the last tenth",
    )
    reach = 1.15 * radius
    ax.set_xlim(centre[0] - reach, centre[0] + reach)
    ax.set_ylim(centre[1] - reach, centre[1] + reach)


def residual_radius(analysis: Analysis, end: str) -> np.ndarray:
    """Return how far the settled positions of an end lie off its fitted circle, um."""
    gap = analysis.ends[end].gap
    if gap is None or gap.radius.value is None:
        return np.empty(0)
    return np.asarray((np.hypot(*(gap.points - centre_of(analysis, end)).T) - gap.radius.value) * UM)


def strip_scale(residual: np.ndarray) -> tuple[float, float]:
    """Return the ends of a strip's scale: those of the middle share of the residuals, with some room beyond."""
    low, high = np.nanquantile(residual, [(1 - MIDDLE) / 2, (1 + MIDDLE) / 2])
    room = 0.15 * (high - low) + 1e-3
    return float(low - room), float(high + room)


def _strip(ax: Axes, analysis: Analysis, end: str) -> None:
    """Radius less the fitted one over the angle from the bottom: median and 95 % range a bin."""
    ax.set_xlabel("angle from the bottom, towards +x [°]")
    ax.set_ylabel("residual radius [µm]")
    gap = analysis.ends[end].gap
    if gap is None or gap.radius.value is None:
        return
    away = gap.points - centre_of(analysis, end)
    deviation = residual_radius(analysis, end)
    low_edge, high_edge = strip_scale(deviation)
    angle = np.rad2deg(np.arctan2(away[:, 0], -away[:, 1]))
    bins = np.round(angle / _BIN_DEG).astype(int)
    rows = []
    for b in np.unique(bins):
        part = deviation[bins == b]
        if len(part) >= 20:  # a 95 % range of fewer is their extremes
            rows.append((b * _BIN_DEG, *np.quantile(part, [0.5, 0.025, 0.975])))
    ax.plot(angle, deviation, ".", markersize=1.2, color=SKY, alpha=0.6, rasterized=True)
    for beyond, edge, marker in ((deviation > high_edge, high_edge, 6), (deviation < low_edge, low_edge, 7)):  # carets
        if beyond.any():
            ax.plot(
                angle[beyond], np.full(beyond.sum(), edge), marker=marker, linestyle="", markersize=2.5, color=PURPLE
            )
    if rows:
        at, middle, low, high = np.array(rows).T
        ax.errorbar(at, middle, [middle - low, high - middle], fmt=".", color=BLUE, markersize=3.5, elinewidth=0.7,
                    label=f"median and 95 % range, bins of {_BIN_DEG:g}°")  # fmt: skip
    ax.axhline(0.0, color=BLACK, linewidth=0.9)
    ax.set_xlim(*np.quantile(angle, [0.0, 1.0]))
    if gap.radius.high is not None:
        width = (gap.radius.high - gap.radius.value) * UM
        ax.axhspan(-width, width, color=GREY, alpha=0.15, linewidth=0, label="95 % interval of the radius")
    ax.set_ylim(low_edge, high_edge)
