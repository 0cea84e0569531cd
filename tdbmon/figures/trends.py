"""Trends of features over the drops, with slope and change point if significant."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.estimate import OUTSIDE
from tdbmon.figures.drop_names import drop_names, drops_label, end_columns
from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    Margins,
    interval_bar,
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
    from tdbmon.history.feature import FeatureKind

_COLUMNS = 2
_ROW_MM = 46
_NAMED = 10  # most drops labelled along an axis
_LETTERS = 20  # per line of an axis label


@styled
def trends(comparison: Comparison, shown: list[Change]) -> Figure:
    """Draw selected quantities over the matching drops and the judged one."""
    rows = math.ceil(len(shown) / _COLUMNS)
    note = "Matching drops in their order · bars: 95 % interval of each drop's own estimate"
    figure = new_figure(25 + _ROW_MM * rows, note)
    axes = subplots(figure, rows, _COLUMNS, Margins(19, 3, 13, 15, across=21, down=17))
    entries = (*comparison.matched, comparison.entry)
    place = {entry.id: i for i, entry in enumerate(entries, start=1)}
    for ax, change in zip(axes.flat, shown, strict=False):
        _draw(ax, change, place, comparison.entry.id)
        drop_names(ax, entries, _NAMED)
        if change.kind.name == "gap_um":
            _limit(ax, change, comparison.settings.inspect.gap_growth)
    end_columns(axes, len(shown), drops_label(entries))
    return figure


def _draw(ax: Axes, change: Change, place: dict[str, int], current: str) -> None:
    factor = scale_of(change.kind.unit)[0]
    series = [*change.earlier, (current, change.estimate)]
    series = [(drop, e) for drop, e in series if e.value is not None]
    at = np.array([place[drop] for drop, _ in series], float)
    values = np.array([e.value for _, e in series], float) * factor
    for x, value, (drop, e) in zip(at, values, series, strict=True):
        colour = ORANGE if drop == current else BLUE
        interval_bar(ax, x, e, factor, color=ORANGE if drop == current else SKY, linewidth=1.2)
        ax.plot(x, value, "o", color=colour, markersize=3.5, zorder=3)
    if change.estimate.value is None:
        not_told(ax, place[current], "o")
    trend, reach = change.trend, len(change.series)
    at, values = at[-reach:], values[-reach:]  # the trend covers the latest drops only
    if trend is not None and trend.step is not None:
        point = trend.step
        edge = (at[point.index - 1] + at[point.index]) / 2
        ax.plot([at[0], edge], [point.before * factor] * 2, "--", color=GREY, linewidth=0.9)
        ax.plot([edge, at[-1]], [point.after * factor] * 2, "--", color=GREY, linewidth=0.9)
        ax.axvline(edge, color=GREY, linewidth=0.5, linestyle=":")
    elif trend is not None and trend.p <= SEEN and trend.slope.value is not None:
        slope = trend.slope.value * factor
        ax.plot(at, np.median(values - slope * at) + slope * at, color=GREEN, linewidth=0.9)
    mark = "  · changed" if change.flag else "  · no value" if change.estimate.value is None else ""
    ax.set_title(change.title + mark, fontsize=7)
    ax.set_ylabel(axis_name(change.kind))


def _limit(ax: Axes, change: Change, growth: float) -> None:
    """Draw the radius at which growth since the earlier drops, or since the start of their slope, reaches the limit."""
    if change.growth_from is None:
        return
    level = change.growth_from * (1 + growth) * scale_of(change.kind.unit)[0]
    ax.axhline(level, color=BLACK, linewidth=0.8)
    ax.annotate(
        f"limit: growth by {stated_percent(growth)}", (0.02, level), (0, -2), xycoords=ax.get_yaxis_transform(),
        textcoords="offset points", ha="left", va="top", fontsize=6, color=BLACK,
    )  # fmt: skip


def axis_name(kind: FeatureKind) -> str:
    """Return the quantity and its unit, wrapped for an axis label."""
    unit = scale_of(kind.unit)[1]
    return textwrap.fill(f"{kind.title.partition(',')[0]} [{unit or 1}]", _LETTERS)


def scale_of(unit: str) -> tuple[float, str]:
    """Return the factor from SI and the name of a unit suited to a feature's axis."""
    if unit == "N/m":
        return 1e-6, "MN/m"
    return OUTSIDE[unit], {"um": "µm", "1": ""}.get(unit, unit)
