"""Forest plot of the differences of a drop from the earlier ones, each quantity in units of its standard error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from tdbmon.figures.style import BLUE, GREY, LIGHT, VERMILION, Margins, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.history.compare import Comparison

# standard errors: the axis is logarithmic beyond, so that large changes fit and small differences stay readable
_LINEAR = 5.0
_TICKS = (2, 4, 10, 20, 50, 100, 200, 500, 1000, 10_000, 100_000)
_ROW_MM = 4.4
_LEFT_MM = 68.0  # for the names of the quantities; more if ends have long names
_TYPE = 6.5


@styled
def differences(comparison: Comparison) -> Figure:
    """Draw the differences with 95 % intervals, in standard errors of a new drop like the earlier ones; flagged ones on top."""
    judged = (c for c in comparison.changes if c.kind.judged and not c.flag)
    shown, scaled = [], []
    for change in (*comparison.flagged, *judged):
        found = change.difference
        if found is not None and found.error and found.low is not None and found.high is not None:
            shown.append(f"{change.title} (n = {found.before.n})")
            scaled.append((found.value / found.error, found.low / found.error, found.high / found.error, change.flag))
    reach = max([_LINEAR, *(1.15 * max(abs(low), abs(high)) for _, low, high, _ in scaled)])
    note = f"Difference from {len(comparison.matched)} matching drops before · in standard errors of a new drop"
    if reach > _LINEAR:
        note += f", logarithmic beyond {_LINEAR:g}"
    figure = new_figure(24 + _ROW_MM * len(shown), note)
    ax = subplots(figure, 1, 1, Margins(_left(figure, shown), 4, 9, 12))[0, 0]
    for row, (value, low, high, flag) in enumerate(scaled):
        colour = VERMILION if flag else BLUE
        ax.plot([low, high], [row, row], color=colour, linewidth=1.0, zorder=2)
        ax.plot(value, row, "o", color=colour, markersize=4, markerfacecolor=colour if flag else "white", zorder=3)
    ax.axvline(0, color=GREY, linewidth=0.8, zorder=1)
    ax.set_xscale("symlog", linthresh=_LINEAR)
    ax.set_xlim(-reach, reach)
    ticks = [tick for tick in _TICKS if tick < reach]
    ax.set_xticks([*(-tick for tick in reversed(ticks)), 0, *ticks], minor=False)
    ax.set_xticks([], minor=True)
    ax.xaxis.set_major_formatter(lambda x, _: f"{x:g}".replace("-", "−"))
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.set_yticks(range(len(shown)), shown, fontsize=_TYPE)
    ax.grid(axis="y", color=LIGHT)
    ax.set_xlabel("less than before   ←   standard errors   →   more than before")
    return figure


def _left(figure: Figure, shown: list[str]) -> float:
    """Return the left margin needed by the names of the quantities, mm."""
    written = figure.text(0, 0, "\n".join(shown), fontsize=_TYPE)
    width = float(written.get_window_extent().width) / figure.dpi * 25.4
    written.remove()
    return max(_LEFT_MM, width + 3)
