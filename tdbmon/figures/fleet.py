"""Small multiples of a fleet: the radius at rest of each machine over its drops, worst machine first."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    PURPLE,
    SKY,
    VERMILION,
    Margins,
    drop_axis,
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

_COLUMNS = 4
_ROW_MM = 37
_SHOWN = 24
_LETTERS = 30  # of a line above a panel
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
)  # of the ends; the frame of an alarm has its own colour
_NEAR = 1.6  # times the scale of the data: a limit up to there is drawn in it


@styled
def fleet(members: list[Member]) -> Figure:
    """Draw the change of the radius at rest of each machine since the first of its matching drops."""
    shown = members[:_SHOWN]
    rows = math.ceil(len(shown) / _COLUMNS)
    more = f" · {len(members) - len(shown)} more machines not drawn" if len(members) > len(shown) else ""
    figure = new_figure(28 + _ROW_MM * rows, f"Radius at rest less that of the first matching drop{more}")
    axes = subplots(figure, rows, _COLUMNS, Margins(13, 3, 16, 18, across=4, down=16.5), sharey=False)
    reach = _reach(shown)
    # an end looks the same on all machines that call it so: they share one legend
    ends_of_all = list(dict.fromkeys(end for member in shown for end in member.gaps()))
    style = {end: _STYLES[k % len(_STYLES)] for k, end in enumerate(ends_of_all)}
    for i, (ax, member) in enumerate(zip(axes.flat, shown, strict=False)):
        colour, width = _EDGE[member.verdict.word]
        for spine in ax.spines.values():
            spine.set(color=colour, linewidth=width)
        ax.set_title(f"{_wrapped(member.machine)}\n{member.verdict.word}", fontsize=6)
        gaps = {end: series for end, series in member.gaps().items() if series}
        if not gaps:
            say(ax, "no radius at rest")
        judged = len(member.comparison.matched) + 1
        for k, (end, series) in enumerate(gaps.items()):
            line, marker = style[end]
            values = np.array([e.value for _, e in series], float) * 1e6
            at = [number for number, _ in series]
            ax.plot(at, values - values[0], marker, color=line, markersize=2.5, linestyle="-", linewidth=0.6, label=end)
            for x, e in series:
                if e.low is not None and e.high is not None:
                    ends = np.array([e.low, e.high]) * 1e6 - values[0]
                    ax.plot([x, x], ends, color=line, linewidth=0.5, alpha=0.6)
            if series[-1][0] != judged:
                not_told(ax, judged, marker, place=k)
        ax.set_ylim(-reach, reach)
        _limit(ax, member, gaps, reach)
        drop_axis(ax, judged, 5)
        if i % _COLUMNS:
            ax.set_yticklabels([])
        else:
            ax.set_ylabel("radius, change [µm]", fontsize=6.5)
    for ax in axes.flat[len(shown) :]:
        ax.set_visible(False)
    for ax in axes.flat[max(0, len(shown) - _COLUMNS) : len(shown)]:
        ax.set_xlabel("drop")
    legend_below(figure, 4)
    return figure


def _limit(ax: Axes, member: Member, gaps: dict[str, list[tuple[int, Estimate]]], reach: float) -> None:
    """Draw the limit of growth of the end that reaches it first, or say that it lies above the scale."""
    found = _limits(member, gaps)
    if not found:
        return
    level, end = min(found)
    words = f"limit {end} {level:+.0f} µm"
    if level > reach:
        ax.annotate(f"{words}: above", (0.98, 0.97), xycoords="axes fraction", ha="right", va="top", fontsize=5)
        return
    ax.axhline(level, color=BLACK, linewidth=0.6)
    ax.annotate(
        words, (0.98, level), (0, -1.5), xycoords=ax.get_yaxis_transform(), textcoords="offset points", ha="right",
        va="top", fontsize=5,
    )  # fmt: skip


def _limits(member: Member, gaps: dict[str, list[tuple[int, Estimate]]]) -> list[tuple[float, str]]:
    """Return by how much the radius has grown since the first of the drops where its limit is reached, µm, and the end."""
    first = {end: series[0][1].value for end, series in gaps.items() if series}
    return [((level - (first[end] or 0.0)) * 1e6, end) for end, level in member.gap_limits.items() if end in first]


def _reach(members: list[Member]) -> float:
    """Half-height of all panels, µm: that of the data, or of the limits where these are near."""
    found = [5.0]
    limits: list[float] = []
    for member in members:
        gaps = member.gaps()
        for series in gaps.values():
            first = (series[0][1].value if series else None) or 0.0
            ends = [x for _, e in series for x in (e.value, e.low, e.high) if x is not None]
            found += [abs(x - first) * 1e6 for x in ends]
        limits += [min(own)[0] for own in [_limits(member, gaps)] if own]
    reach = 1.2 * max(found)
    return max([reach, *(1.1 * limit for limit in limits if limit < _NEAR * reach)])


def _wrapped(name: str) -> str:
    """A name in two lines above a panel; of a longer one its beginning and its end, in which machines of one kind differ."""
    lines = textwrap.wrap(name, _LETTERS)
    return "\n".join(lines) if len(lines) <= 2 else f"{lines[0]}\n…{name[1 - _LETTERS :]}"
