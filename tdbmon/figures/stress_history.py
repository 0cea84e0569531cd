"""Box plots of the Hertz stress of a machine's filed drops; the whisker ends at the greatest, for the least is not filed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.style import BLACK, BLUE, GREY, ORANGE, SKY, VERMILION, Margins, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.history.compare import Comparison

_MPA = 1e-6
_SHOWN = 20
_NEAR = 1.6  # times the top of the boxes' scale: up to there a limit is drawn in it


@styled
def stress_history(comparison: Comparison) -> Figure:
    """Draw the boxes of the latest drops with forces, the drop that is compared in orange."""
    ends = comparison.stress
    figure = new_figure(
        34 + 56 * len(ends), "Greatest Hertz stress among the balls while loaded · fitted simulation, not measured"
    )
    axes = subplots(figure, len(ends), 1, Margins(17, 3, 11, 17, down=15))[:, 0]
    names = {e.id: e.raw_name for e in (*comparison.matched, comparison.entry)}
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
            flierprops={"marker": ".", "markersize": 3, "markeredgecolor": GREY},
            meanprops={"marker": "x", "markersize": 4, "markeredgecolor": BLACK},
            medianprops={"color": BLACK},
        )  # fmt: skip
        for (drop, _), patch in zip(rows, made["boxes"], strict=True):
            current = drop == comparison.entry.id
            patch.set_facecolor(ORANGE if current else SKY)
            patch.set_edgecolor(BLACK if current else BLUE)
        ax.set_ylabel(f"{end} stress [MPa]")
        ax.set_ylim(bottom=0)
        labels = [short_name(names.get(drop, drop)) for drop, _ in rows]
        ax.set_xticks(
            range(1, len(rows) + 1),
            labels,
            rotation=30 if len(rows) > 6 else 0,
            ha="right" if len(rows) > 6 else "center",
        )
    limit_line(list(axes), comparison.settings.inspect.stress)
    return figure


def limit_line(axes: Sequence[Axes], limit: float) -> None:
    """Draw the stress (Pa) that asks for an inspection; where it lies far above the boxes, say so in the corner."""
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


def short_name(name: str) -> str:
    """Return a file's name without its ending, its middle cut out where it is long: drops differ in how names end."""
    stem = name.rsplit(".", 1)[0]
    return stem if len(stem) <= 14 else f"{stem[:4]}…{stem[-9:]}"
