"""A forest plot: the difference of a drop from those before, each quantity in its own standard error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from tdbmon.figures.style import BLUE, GREY, LIGHT, VERMILION, Margins, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.history.compare import Comparison

REACH = 8.0  # standard errors: what lies beyond is drawn at the edge with an arrow
_ROW_MM = 4.4


@styled
def differences(comparison: Comparison) -> Figure:
    """Draw the differences with their 95 % intervals, in standard errors of a new drop like those before."""
    shown = [
        c for c in comparison.changes if c.difference is not None and c.difference.error is not None and c.kind.judged
    ]
    note = f"Difference from {len(comparison.matched)} matching drops before · in standard errors of a new drop"
    figure = new_figure(24 + _ROW_MM * len(shown), note)
    ax = subplots(figure, 1, 1, Margins(68, 4, 9, 12))[0, 0]
    for row, change in enumerate(shown):
        found = change.difference
        if found is None or found.error is None or found.low is None or found.high is None:
            continue
        value, low, high = (x / found.error for x in (found.value, found.low, found.high))
        colour = VERMILION if change.flag else BLUE
        ax.plot([max(low, -REACH), min(high, REACH)], [row, row], color=colour, linewidth=1.0, zorder=2)
        if abs(value) <= REACH:
            ax.plot(
                value,
                row,
                "o",
                color=colour,
                markersize=4,
                markerfacecolor=colour if change.flag else "white",
                zorder=3,
            )
        else:
            side = 1 if value > 0 else -1
            ax.plot(side * REACH, row, ">" if side > 0 else "<", color=colour, markersize=5, clip_on=False, zorder=3)
            near = min(low, REACH) if side > 0 else max(high, -REACH)  # before the bar, which would strike it out
            ax.annotate(
                f"{value:.0f}".replace("-", "−"), (near, row), xytext=(-side * 5, 0), textcoords="offset points",
                ha="right" if side > 0 else "left", va="center", fontsize=6.5, color=colour,
            )  # fmt: skip
    ax.axvline(0, color=GREY, linewidth=0.8, zorder=1)
    ax.set_xlim(-REACH, REACH)
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.set_yticks(
        range(len(shown)), [f"{c.title} (n = {c.difference.before.n})" for c in shown if c.difference], fontsize=6.5
    )
    ax.grid(axis="y", color=LIGHT)
    ax.set_xlabel("less than before   ←   standard errors   →   more than before")
    return figure
