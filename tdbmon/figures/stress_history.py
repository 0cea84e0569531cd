"""Box plots of the Hertz stress of a machine's filed drops; the whisker ends at the maximum, as the minimum is not filed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.drop_names import drop_names, drops_label
from tdbmon.figures.style import BLACK, BLUE, ORANGE, SKY, VERMILION, Margins, name_axis, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.history.compare import Comparison

_MPA = 1e-6
_SHOWN = 20
_FLAT = 6  # most names that fit side by side without slant
_NEAR = 1.6  # times the top of the boxes' scale: a limit up to there extends the scale


@styled
def stress_history(comparison: Comparison) -> Figure:
    """Draw the boxes of the latest drops with forces, the judged drop in orange."""
    ends = comparison.stress
    figure = new_figure(
        35 + 58 * len(ends), "Greatest Hertz stress among the balls while loaded · fitted simulation, not measured"
    )
    axes = subplots(figure, len(ends), 1, Margins(17, 3, 11, 19, down=18))[:, 0]
    entries = {e.id: e for e in (*comparison.matched, comparison.entry)}
    for ax, (end, rows) in zip(axes, ends.items(), strict=True):
        rows = rows[-_SHOWN:]
        stats = [
            {
                "med": box.median * _MPA,
                "q1": box.q1 * _MPA,
                "q3": box.q3 * _MPA,
                "whislo": box.q1 * _MPA,
                "whishi": box.greatest * _MPA,
                "mean": box.mean * _MPA,
                "fliers": [x * _MPA for x in box.outliers],
            }
            for _, box in rows
        ]
        made = ax.bxp(
            stats, positions=range(1, len(rows) + 1), showmeans=True, patch_artist=True, widths=0.55,
            flierprops={"marker": "o", "markersize": 3, "markeredgecolor": VERMILION, "markerfacecolor": "none", "zorder": 5},
            meanprops={"marker": "x", "markersize": 4, "markeredgecolor": BLACK},
            medianprops={"color": BLACK},
        )  # fmt: skip
        for line in (*made["caps"][::2], *made["whiskers"][::2]):
            line.set_visible(False)  # lower whiskers: they would show the box's edge as the minimum
        for (drop, _), patch in zip(rows, made["boxes"], strict=True):
            current = drop == comparison.entry.id
            patch.set_facecolor(ORANGE if current else SKY)
            patch.set_edgecolor(BLACK if current else BLUE)
        name_axis(ax, "{} stress [MPa]", end)
        ax.set_ylim(bottom=0)
        drop_names(ax, [entries[drop] for drop, _ in rows], _SHOWN, _FLAT)
        ax.set_xlabel(drops_label([entries[drop] for drop, _ in rows]))
    limit_line(list(axes), comparison.settings.inspect.stress)
    return figure


def limit_line(axes: Sequence[Axes], limit: float) -> None:
    """Draw the stress limit (Pa); if it lies far above the boxes, a note in the corner says so."""
    tops, level = [ax.get_ylim()[1] for ax in axes], limit * _MPA
    for ax, top in zip(axes, tops, strict=True):
        if level < _NEAR * top:
            ax.set_ylim(top=max(top, 1.1 * level))
            ax.axhline(level, color=VERMILION, linewidth=1.0)
            words, height, up = f"limit {level:.0f} MPa", level / ax.get_ylim()[1], "bottom"
        else:
            ax.set_ylim(top=1.2 * top)
            words, height, up = f"limit {level:.0f} MPa: above this scale", 0.97, "top"
        ax.annotate(words, (0.99, height), xycoords="axes fraction", ha="right", va=up, color=VERMILION, fontsize=6.5)
