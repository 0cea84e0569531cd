"""Measured and simulated displacement at both ends with their residual, over the fitted interval and beyond."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.style import (
    GREY,
    LIGHT,
    MEASURED,
    UM,
    VERMILION,
    Margins,
    legend_below,
    name_axis,
    new_figure,
    plane_words,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.identify.agreement import Agreement, EndAgreement

_ROW_MM = 27


@styled
def displacements_against_simulated(found: Agreement) -> Figure:
    """Draw x and y of each end, in a pair of rows each: displacement above, measured minus simulated below.

    The left column covers the fitted interval, the right one the whole simulation.
    """
    where = plane_words({end: each.plane for end, each in found.ends.items()})
    note = (
        f"Displacement {where}, from the fitted bearing centres · x right, y up · not filtered"
        " · residual: measured less simulated"
    )
    rows = [(end, axis) for end in found.ends.values() for axis in range(2)]
    figure = new_figure(32 + _ROW_MM * len(rows), note)
    axes = subplots(
        figure, 2 * len(rows), 2, Margins(20, 3, 15, 18, across=13, down=2.5),
        height_ratios=[1.7, 1.0] * len(rows), sharex=False,
    )  # fmt: skip
    last = float(found.time[-1])
    spans = (
        (f"to {found.fitted_to * 1e3:.0f} ms: fitted", found.fitted_to),
        (f"to {last * 1e3:.0f} ms: not fitted beyond the dotted line", last),
    )
    for column, (words, stop) in enumerate(spans):
        axes[0, column].set_title(words)
        for row, (end, axis) in enumerate(rows):
            pair = axes[2 * row, column], axes[2 * row + 1, column]
            _pair(*pair, found, end, axis, stop)
            for ax in pair:
                ax.set_xlim(0, stop * 1e3)
                if ax is not axes[-1, column]:
                    ax.tick_params(labelbottom=False)
            if column == 0:
                name_axis(pair[0], f"{{}} {'xy'[axis]}\n[µm]", end.end)
                pair[1].set_ylabel("residual\n[µm]")
        axes[-1, column].set_xlabel("time from the release [ms]")
    for ax in axes[:, 0]:
        ax.yaxis.set_label_coords(-10.5 / 67, 0.5)
    legend_below(figure, 4)
    return figure


def _pair(above: Axes, below: Axes, found: Agreement, end: EndAgreement, axis: int, stop: float) -> None:
    inside = (found.time >= 0) & (found.time <= stop)
    time = found.time[inside] * 1e3
    above.plot(time, end.measured[axis, inside] * UM, color=MEASURED, linewidth=2.2, label="measured", rasterized=True)
    above.plot(
        time, end.simulated[axis, inside] * UM, color=VERMILION, linewidth=0.8, label="simulated", rasterized=True
    )
    band = 2 * end.noise[axis] * UM
    below.axhspan(-band, band, color=LIGHT, linewidth=0, label="twice the noise")
    left = end.residual[axis, inside] * UM
    below.plot(time, left, color=VERMILION, linewidth=0.7, rasterized=True)
    reach = 1.1 * max(2 * band, float(np.fmax.reduce(np.abs(left), initial=0.0)))
    below.set_ylim(-reach, reach)
    if stop > found.fitted_to + 1e-9:
        for ax in (above, below):
            ax.axvline(found.fitted_to * 1e3, color=GREY, linestyle=":", linewidth=0.9, label="end of the fit")
