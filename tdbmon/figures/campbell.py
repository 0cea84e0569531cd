"""Campbell diagram of the rotor at rest on its touchdown bearings, with the spectral lines found in the record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.critical_speed_map import COLOUR, by_direction
from tdbmon.figures.style import BLACK, GREY, PURPLE, Margins, legend_below, new_figure, styled, subplots
from tdbmon.identify.natural_frequencies import ORDERS

if TYPE_CHECKING:
    from tdbmon.analysis.lines import Line
    from tdbmon.analysis.result import Analysis
    from tdbmon.identify.natural_frequencies import NaturalFrequencies


@styled
def campbell(found: NaturalFrequencies, analysis: Analysis, lines: Sequence[Line]) -> Figure:
    """Draw natural frequencies against speed with orders of rotation, and measured lines over the speeds at which they appear."""
    figure = new_figure(92, "Rotor at rest on its calibrated touchdown bearings · gyroscopic effect of each speed · undamped")
    ax = subplots(figure, 1, 1, Margins(15, 12, 11, 22))[0, 0]
    speeds = found.speeds
    top = 1.05 * max(float(found.against_speed.frequencies.max()), 1.0)
    for k in range(found.against_speed.frequencies.shape[1]):
        for direction, curve in by_direction(found.against_speed, k).items():
            ax.plot(speeds, curve, color=COLOUR[direction], linewidth=1.1, label=direction)
    for order in ORDERS:
        ax.plot(speeds, order * speeds, color=GREY, linestyle=(0, (4, 2)), linewidth=0.8, label="orders of rotation")
        at = min(float(speeds[-1]), top / order)
        leaves_above = at < speeds[-1]
        ax.annotate(f"{order:g}X", (at, order * at), xytext=(0, 2) if leaves_above else (3, 0), color=GREY, fontsize=7,
                    textcoords="offset points", ha="center" if leaves_above else "left",
                    va="bottom" if leaves_above else "center", annotation_clip=False)  # fmt: skip
    for mode in found.modes:
        for order, critical in zip(ORDERS, mode.critical, strict=True):
            if critical is not None:
                ax.plot(
                    critical,
                    order * critical,
                    "o",
                    color=BLACK,
                    markersize=3.5,
                    zorder=5,
                    label="critical speed, passed",
                )
    if analysis.has_speed:
        for line in lines:
            seen = np.interp([line.first_s, line.last_s], analysis.speed_time, analysis.speed_hz)
            hz = line.frequency.value
            ax.plot(
                seen,
                [hz, hz],
                color=PURPLE,
                linewidth=3.5,
                alpha=0.45,
                solid_capstyle="butt",
                label="line in the record",
            )
    ax.axvline(found.speed, color=GREY, linestyle=":", linewidth=0.9, label="speed at the release")
    ax.set_xlim(0, speeds[-1])
    ax.set_ylim(0, top)
    ax.set_xlabel("speed [Hz]")
    ax.set_ylabel("frequency [Hz]")
    legend_below(figure, 3)
    return figure
