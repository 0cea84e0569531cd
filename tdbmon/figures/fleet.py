"""Small multiples of a fleet: the radius at rest of each machine over its drops, worst machine first."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.style import (
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
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
_STYLES = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"), (ORANGE, "D"))


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
        drop_axis(ax, judged, 5)
        if i % _COLUMNS:
            ax.set_yticklabels([])
        else:
            ax.set_ylabel("[µm]")
    for ax in axes.flat[len(shown) :]:
        ax.set_visible(False)
    for ax in axes.flat[max(0, len(shown) - _COLUMNS) : len(shown)]:
        ax.set_xlabel("drop")
    legend_below(figure, 4)
    return figure


def _reach(members: list[Member]) -> float:
    """Half-height of all panels, µm."""
    found = [5.0]
    for member in members:
        for series in member.gaps().values():
            first = (series[0][1].value if series else None) or 0.0
            ends = [x for _, e in series for x in (e.value, e.low, e.high) if x is not None]
            found += [abs(x - first) * 1e6 for x in ends]
    return 1.2 * max(found)


def _wrapped(name: str) -> str:
    """A name in two lines above a panel; of a longer one its beginning and its end, in which machines of one kind differ."""
    lines = textwrap.wrap(name, _LETTERS)
    return "\n".join(lines) if len(lines) <= 2 else f"{lines[0]}\n…{name[1 - _LETTERS :]}"
