"""Gap map: settled positions, the clearance circle fitted to them, and their residuals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import CARETDOWN, CARETUP
from tdbsim.errors import InputError

from tdbmon.figures.orbit_axes import circle, orbit_axes, show_about
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
# least positions in a bin with a bar, absolute and as a share of all: the 95 % range of fewer rests on one or two of them
_LEAST, _SHARE = 20, 0.02
MIDDLE = 0.99  # of the residuals lie within the scale of the residual plot: a few outliers would flatten all others


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
    orbit_axes(ax)
    gap = analysis.ends[end].gap
    if gap is None:
        return
    centre, radius = gap.place * UM, gap.size * UM
    ax.plot(*(gap.points.T * UM), ".", markersize=1.5, color=BLUE, rasterized=True, label="settled positions")
    circle(ax, centre, radius, linewidth=1.0, label="fitted circle, radius at rest")
    if gap.radius.low is not None and gap.radius.high is not None:
        for limit in (gap.radius.low, gap.radius.high):
            circle(ax, centre, limit * UM, linewidth=0.5, linestyle=(0, (4, 2)))
    air, drawing = analysis.ends[end].air_gap.value, analysis.machine.bearing(end).radial_gap.nominal
    if air is not None:
        circle(ax, centre, air * UM, color=GREEN, linewidth=1.0, label="air gap")
    circle(ax, centre, drawing * UM, color=ORANGE, linewidth=1.0, linestyle=(0, (1, 1)), label="gap on the drawing")
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
    show_about(ax, centre, 1.15 * radius)


@dataclass(frozen=True, eq=False)
class ResidualRadius:
    """Radial residuals of the settled positions of an end about its fitted circle.

    Attributes
    ----------
    angle : (n,) array
        Angle from the bottom towards +x, degrees.
    residual : (n,) array
        Radial residual, um, positive outwards.
    bins : (4, b) array
        Centre in degrees; median, 2.5 and 97.5 % quantile of the residuals (um) of each angular bin with enough positions.
    """

    angle: np.ndarray
    residual: np.ndarray
    bins: np.ndarray

    @property
    def scale(self) -> tuple[float, float]:
        """Axis limits that contain the central 99 % of the residuals and all bins, with a small margin."""
        tail = (1 - MIDDLE) / 2
        edges = np.concatenate([np.quantile(self.residual, [tail, 1 - tail]), *self.bins[2:]])
        room = 0.08 * float(np.ptp(edges)) + 1e-3
        return float(edges.min()) - room, float(edges.max()) + room

    @property
    def beyond(self) -> int:
        """Number of positions beyond these limits."""
        low, high = self.scale
        return int(np.sum((self.residual < low) | (self.residual > high)))


def residual_radius(analysis: Analysis, end: str) -> ResidualRadius | None:
    """Return the radial residuals of an end's settled positions about its circle; None without a circle."""
    gap = analysis.ends[end].gap
    if gap is None:
        return None
    away = gap.points - gap.place
    residual = (np.hypot(*away.T) - gap.size) * UM
    angle = np.rad2deg(np.arctan2(away[:, 0], -away[:, 1]))
    bins, rows = np.round(angle / _BIN_DEG).astype(int), []
    for b in np.unique(bins):
        part = residual[bins == b]
        if len(part) >= max(_LEAST, _SHARE * len(residual)):
            rows.append((b * _BIN_DEG, *np.quantile(part, [0.5, 0.025, 0.975])))
    return ResidualRadius(angle, residual, np.array(rows).reshape(-1, 4).T)


def _strip(ax: Axes, analysis: Analysis, end: str) -> None:
    """Draw the radius minus the fitted one against the angle from the bottom, with median and 95 % range of each bin."""
    ax.set_xlabel("angle from the bottom, towards +x [°]")
    ax.set_ylabel("residual radius [µm]")
    found, gap = residual_radius(analysis, end), analysis.ends[end].gap
    if found is None or gap is None:
        return
    angle, residual, (least, most) = found.angle, found.residual, found.scale
    ax.plot(angle, residual, ".", markersize=1.2, color=SKY, alpha=0.6, rasterized=True)
    for beyond, edge, caret in ((residual > most, most, CARETUP), (residual < least, least, CARETDOWN)):
        if beyond.any():
            at = np.full(beyond.sum(), edge)
            ax.plot(angle[beyond], at, marker=caret, linestyle="", markersize=2.5, color=PURPLE)
    if found.bins.size:
        at, middle, low, high = found.bins
        ax.errorbar(at, middle, [middle - low, high - middle], fmt=".", color=BLUE, markersize=3.5, elinewidth=0.7,
                    label=f"median and 95 % range, bins of {_BIN_DEG:g}°")  # fmt: skip
    ax.axhline(0.0, color=BLACK, linewidth=0.9)
    ax.set_xlim(*np.quantile(angle, [0.0, 1.0]))
    if gap.radius.low is not None and gap.radius.high is not None:
        low, high = ((limit - gap.size) * UM for limit in (gap.radius.low, gap.radius.high))
        ax.axhspan(low, high, color=GREY, alpha=0.15, linewidth=0, label="95 % interval of the radius")
    ax.set_ylim(least, most)
