"""The course of quantities over the drops, with slope and change point where the tests see one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.estimate import OUTSIDE
from tdbmon.figures.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    Margins,
    drop_axis,
    new_figure,
    not_told,
    styled,
    subplots,
)
from tdbmon.history.change_point import SEEN
from tdbmon.quantity import stated_percent

if TYPE_CHECKING:
    from tdbmon.history.change import Change
    from tdbmon.history.compare import Comparison

_COLUMNS = 2
_ROW_MM = 42


@styled
def trends(comparison: Comparison, shown: list[Change]) -> Figure:
    """Draw some quantities over the matching drops and this one."""
    rows = math.ceil(len(shown) / _COLUMNS)
    note = "Matching drops in their order · bars: 95 % interval of each drop's own estimate"
    figure = new_figure(22 + _ROW_MM * rows, note)
    axes = subplots(figure, rows, _COLUMNS, Margins(17, 3, 13, 11, across=18, down=13))
    place = {entry.id: i for i, entry in enumerate((*comparison.matched, comparison.entry), start=1)}
    for ax, change in zip(axes.flat, shown, strict=False):
        _draw(ax, change, place, comparison.entry.id)
        if change.kind.name == "gap_um":
            _limit(ax, change, comparison.settings.inspect.gap_growth)
    for ax in axes.flat[len(shown) :]:
        ax.set_visible(False)
    for ax in axes[-1]:
        ax.set_xlabel("drop")
    return figure


def _draw(ax: Axes, change: Change, place: dict[str, int], current: str) -> None:
    factor, unit = scale_of(change.kind.unit)
    series = [*change.earlier, (current, change.estimate)]
    series = [(drop, e) for drop, e in series if e.value is not None]
    at = np.array([place[drop] for drop, _ in series], float)
    values = np.array([e.value for _, e in series], float) * factor
    for x, value, (drop, e) in zip(at, values, series, strict=True):
        colour = ORANGE if drop == current else BLUE
        if e.low is not None and e.high is not None:
            ax.plot([x, x], [e.low * factor, e.high * factor], color=ORANGE if drop == current else SKY, linewidth=1.2)
        ax.plot(x, value, "o", color=colour, markersize=3.5, zorder=3)
    if change.estimate.value is None:
        not_told(ax, place[current], "o")
    trend, reach = change.trend, len(change.series)
    at, values = at[-reach:], values[-reach:]  # the trend goes over the latest drops alone
    if trend is not None and trend.change is not None and trend.change.p <= SEEN:
        point = trend.change
        edge = (at[point.index - 1] + at[point.index]) / 2
        ax.plot([at[0], edge], [point.before * factor] * 2, "--", color=GREY, linewidth=0.9)
        ax.plot([edge, at[-1]], [point.after * factor] * 2, "--", color=GREY, linewidth=0.9)
        ax.axvline(edge, color=GREY, linewidth=0.5, linestyle=":")
    elif trend is not None and trend.p <= SEEN and trend.slope.value is not None:
        slope = trend.slope.value * factor
        ax.plot(at, np.median(values - slope * at) + slope * at, color=GREEN, linewidth=0.9)
    mark = "  · changed" if change.flag else "  · not told by this drop" if change.estimate.value is None else ""
    ax.set_title(change.title + mark, fontsize=7)
    ax.set_ylabel(f"[{unit or 1}]")
    drop_axis(ax, len(place), 8)


def _limit(ax: Axes, change: Change, growth: float) -> None:
    """Draw at which radius the growth since the drops before, or since their slope begins, reaches the limit."""
    before = [e.value for drop, e in change.earlier if e.value is not None and drop not in change.left_out]
    usual = float(np.median(before)) if change.level is None else change.level
    level = usual * (1 + growth) * scale_of(change.kind.unit)[0]
    ax.axhline(level, color=VERMILION, linewidth=0.8)
    ax.annotate(
        f"limit: growth by {stated_percent(growth)}", (0.02, level), (0, -2), xycoords=ax.get_yaxis_transform(),
        textcoords="offset points", ha="left", va="top", fontsize=6, color=VERMILION,
    )  # fmt: skip


def scale_of(unit: str) -> tuple[float, str]:
    """Return the factor from SI and the unit in which a feature's numbers are short."""
    if unit == "N/m":
        return 1e-6, "MN/m"
    return OUTSIDE[unit], {"um": "µm", "1": ""}.get(unit, unit)
