"""Small multiples of a fleet: the radius at rest of each machine over its drops, worst machine first."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.drop_names import end_columns
from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    PURPLE,
    SKY,
    UM,
    VERMILION,
    Margins,
    drop_axis,
    interval_bar,
    legend_below,
    new_figure,
    not_told,
    say,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from tdbmon.estimate import Estimate
    from tdbmon.history.fleet import Member

    Gaps = dict[str, list[tuple[int, Estimate]]]  # for each end, its radius at rest over the drops

_COLUMNS = 4
_ROW_MM = 37
_SHOWN = 24
_LETTERS = 30  # per line of a panel's title
_EDGE = {
    "inspect": (VERMILION, 2.0),
    "changed": (VERMILION, 1.2),
    "no drop": (VERMILION, 1.2),
    "too few drops": (GREY, 0.6),
    "as before": (LIGHT, 0.8),
}
_STYLES = (
    (BLUE, "o"),
    (GREEN, "s"),
    (PURPLE, "^"),
    (SKY, "D"),
)  # of the ends; the frame of a panel has the colour of the verdict
_NEAR = 1.6  # times the scale of the data: a limit up to there extends the scale


@styled
def fleet(members: list[Member]) -> Figure:
    """Draw the change of the radius at rest of each machine since the first of its matching drops."""
    shown = members[:_SHOWN]
    rows = math.ceil(len(shown) / _COLUMNS)
    more = f" · {len(members) - len(shown)} more machines not drawn" if len(members) > len(shown) else ""
    figure = new_figure(28 + _ROW_MM * rows, f"Change of the radius at rest since the first matching drop{more}")
    axes = subplots(figure, rows, _COLUMNS, Margins(13, 3, 16, 18, across=4, down=16.5))
    of_all = [member.gaps() for member in shown]
    limits = [_limit_of(member, gaps) for member, gaps in zip(shown, of_all, strict=True)]
    reach = _reach(of_all, limits)
    # ends with the same name have the same style on all machines, since these share one legend
    ends_of_all = list(dict.fromkeys(end for gaps in of_all for end in gaps))
    style = {end: _STYLES[k % len(_STYLES)] for k, end in enumerate(ends_of_all)}
    for i, (ax, member, every, limit) in enumerate(zip(axes.flat, shown, of_all, limits, strict=False)):
        colour, width = _EDGE[member.verdict.word]
        for spine in ax.spines.values():
            spine.set(color=colour, linewidth=width)
        ax.set_title(f"{_wrapped(member.machine)}\n{member.verdict.word}", fontsize=6)
        gaps = {end: series for end, series in every.items() if series}
        if not gaps:
            say(ax, "no radius at rest")
        judged = len(member.comparison.matched) + 1
        for k, (end, series) in enumerate(gaps.items()):
            line, marker = style[end]
            values = np.array([e.value for _, e in series], float) * UM
            at = [number for number, _ in series]
            ax.plot(at, values - values[0], marker, color=line, markersize=2.5, linestyle="-", linewidth=0.6, label=end)
            for x, e in series:
                interval_bar(ax, x, e, UM, values[0], color=line, linewidth=0.5, alpha=0.6)
            if series[-1][0] != judged:
                not_told(ax, judged, marker, place=k)
        ax.set_ylim(-reach, reach)
        if limit is not None:
            _draw_limit(ax, *limit, reach)
        drop_axis(ax, judged, 5)
        if i % _COLUMNS:
            ax.set_yticklabels([])
        else:
            ax.set_ylabel("radius, change [µm]", fontsize=6.5)
    end_columns(axes, len(shown), "drop")
    legend_below(figure, 4)
    return figure


def _draw_limit(ax: Axes, level: float, end: str, reach: float) -> None:
    """Draw the growth limit of an end, or a note that it lies above the scale."""
    words = f"limit {end} {level:+.0f} µm"
    if level > reach:
        ax.annotate(f"{words}: above", (0.98, 0.97), xycoords="axes fraction", ha="right", va="top", fontsize=5)
        return
    ax.axhline(level, color=BLACK, linewidth=0.6)
    ax.annotate(
        words, (0.98, level), (0, -1.5), xycoords=ax.get_yaxis_transform(), textcoords="offset points", ha="right",
        va="top", fontsize=5,
    )  # fmt: skip


def _limit_of(member: Member, gaps: Gaps) -> tuple[float, str] | None:
    """Return the least growth limit of any end, µm above its first radius, and the name of that end; None without one."""
    first = {end: series[0][1].value or 0.0 for end, series in gaps.items() if series}
    return min(
        (((level - first[end]) * UM, end) for end, level in member.gap_limits.items() if end in first), default=None
    )


def _reach(of_all: list[Gaps], limits: list[tuple[float, str] | None]) -> float:
    """Return the half-height of all panels, µm, from the data, and from the limits if these are near."""
    found = [5.0]
    for series in (series for gaps in of_all for series in gaps.values() if series):
        first = series[0][1].value or 0.0
        ends = [x for _, e in series for x in (e.value, e.low, e.high) if x is not None]
        found += [abs(x - first) * UM for x in ends]
    reach = 1.2 * max(found)
    return max([reach, *(1.1 * limit[0] for limit in limits if limit is not None and limit[0] < _NEAR * reach)])


def _wrapped(name: str) -> str:
    """Return a name wrapped to two lines; of a longer one beginning and end, since similar machines differ at the end."""
    lines = textwrap.wrap(name, _LETTERS)
    return "\n".join(lines) if len(lines) <= 2 else f"{lines[0]}\n…{name[1 - _LETTERS :]}"
