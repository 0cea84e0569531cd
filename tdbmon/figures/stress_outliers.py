"""Box plots of the Hertz stress of jointly fitted drops, with outliers by two rules; whiskers end within Tukey's fence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.fatigue import STATIC_LIMIT

from tdbmon.figures.drop_names import names_along
from tdbmon.figures.stress_history import limit_line
from tdbmon.figures.style import BLACK, BLUE, GREY, SKY, VERMILION, Margins, legend_below, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.identify.forces import DropForces
    from tdbmon.identify.stress import Stress

_MPA = 1e-6


@styled
def stress_outliers(drops: Sequence[DropForces]) -> Figure:
    """Draw the box of each drop, one panel per end, with the limits of both outlier rules."""
    note = (
        f"Greatest Hertz stress among the balls while loaded, {drops[0].seconds:g} s · fitted simulation, not measured"
    )
    figure = new_figure(80, note)
    ends = list(drops[0].ends)
    many = len(drops) > 2  # slanted names
    axes = subplots(figure, 1, len(ends), Margins(15, 3, 13, 24 if many else 15, across=6), sharey=True)[0]
    for ax, end in zip(axes, ends, strict=True):
        for at, drop in enumerate(drops, start=1):
            _box(ax, at, drop.ends[end].stress)
        ax.set_title(end)
        names_along(ax, range(1, len(drops) + 1), [drop.name for drop in drops], aslant=many)
        ax.set_xlim(0.4, len(drops) + 0.6)
        ax.set_ylim(bottom=0)
    limit_line(list(axes), STATIC_LIMIT)
    axes[0].set_ylabel("stress [MPa]")
    legend_below(figure, 4)
    return figure


def _box(ax: Axes, at: int, box: Stress) -> None:
    if not box.greatest.known:
        ax.annotate("no ball loaded", (at, 0.5), xycoords=("data", "axes fraction"), ha="center", color=GREY)
        return
    ax.bxp(
        [{"med": box.median * _MPA, "q1": box.q1 * _MPA, "q3": box.q3 * _MPA, "mean": box.mean * _MPA,
          "whislo": box.least * _MPA, "whishi": _whisker(box) * _MPA}],
        positions=[at], showmeans=True, showfliers=False, patch_artist=True, widths=0.5,
        boxprops={"facecolor": SKY, "edgecolor": BLUE},
        meanprops={"marker": "x", "markersize": 5, "markeredgecolor": BLACK},
        medianprops={"color": BLACK},
    )  # fmt: skip
    for peaks, marker, colour, size, words in (
        (box.tukey, ".", GREY, 4, "beyond Tukey's fence"), (box.outliers, "o", VERMILION, 6, "beyond three deviations")
    ):  # fmt: skip
        if not peaks:
            continue
        ax.plot([at] * len(peaks), [p * _MPA for p in peaks], marker, color=colour, markerfacecolor="none",
                markersize=size, linestyle="none", label=words)  # fmt: skip
    for level, style, words in (
        (box.tukey_level, ":", "Tukey's fence"), (box.outlier_level, "--", "mean + 3 deviations")
    ):  # fmt: skip
        ax.plot([at - 0.4, at + 0.4], [level * _MPA] * 2, linestyle=style, color=GREY, label=words)


def _whisker(box: Stress) -> float:
    """Return the upper whisker: the fence itself if peaks lie beyond, since a continuous history passes it, else the maximum."""
    return box.tukey_level if box.tukey else max(box.q3, min(box.greatest.value or 0.0, box.tukey_level))
