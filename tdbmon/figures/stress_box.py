"""Box plot of the Hertz stress of one drop, an end a box, with outliers by two rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from tdbmon.figures.style import BLACK, BLUE, GREY, SKY, VERMILION, Margins, legend_below, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.identify.forces import DropForces
    from tdbmon.identify.stress import Stress

_MPA = 1e-6


@styled
def stress_box(drop: DropForces) -> Figure:
    """Draw the box of each end with the limits of both rules."""
    note = f"Greatest Hertz stress among the balls while loaded, {drop.seconds:g} s · fitted simulation, not measured"
    figure = new_figure(78, note)
    ax = subplots(figure, 1, 1, Margins(17, 45, 9, 18))[0, 0]
    for at, (name, end) in enumerate(drop.ends.items(), start=1):
        box = end.stress
        if not box.greatest.known:
            ax.annotate(
                f"{name}: no ball loaded", (at, 0.5), xycoords=("data", "axes fraction"), ha="center", color=GREY
            )
            continue
        ax.bxp(
            [{"med": box.median * _MPA, "q1": box.q1 * _MPA, "q3": box.q3 * _MPA, "mean": box.mean * _MPA,
              "whislo": box.q1 * _MPA, "whishi": _whisker(box) * _MPA}],
            positions=[at], showmeans=True, showfliers=False, patch_artist=True, widths=0.5,
            boxprops={"facecolor": SKY, "edgecolor": BLUE},
            meanprops={"marker": "x", "markersize": 5, "markeredgecolor": BLACK},
            medianprops={"color": BLACK},
        )  # fmt: skip
        for peaks, marker, colour, words in (
            (box.tukey, ".", GREY, "beyond Tukey's fence"), (box.outliers, "o", VERMILION, "beyond three deviations")
        ):  # fmt: skip
            ax.plot([at] * len(peaks), [p * _MPA for p in peaks], marker, color=colour, markerfacecolor="none",
                    markersize=6 if marker == "o" else 4, linestyle="none", label=words)  # fmt: skip
        for level, style, words in (
            (box.tukey_level, ":", "Tukey's fence"), (box.outlier_level, "--", "mean + 3 deviations")
        ):  # fmt: skip
            ax.plot([at - 0.4, at + 0.4], [level * _MPA] * 2, linestyle=style, color=GREY, label=words)
    ax.set_xticks(range(1, len(drop.ends) + 1), [f"{name} [end]" for name in drop.ends])
    ax.set_xlim(0.4, len(drop.ends) + 0.6)
    ax.set_ylim(bottom=0)
    ax.set_ylabel("stress [MPa]")
    legend_below(figure, 4)
    return figure


def _whisker(box: Stress) -> float:
    """Return the greatest stress within Tukey's fence; a history passes it on the way to what lies beyond."""
    return box.tukey_level if box.tukey else max(box.q3, min(box.greatest.value or 0.0, box.tukey_level))
