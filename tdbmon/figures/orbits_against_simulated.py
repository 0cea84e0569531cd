"""Measured and simulated orbits of both ends, over the fitted interval and beyond."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.orbit_axes import circle, orbit_axes, rotation_arrow, show_about
from tdbmon.figures.style import BLACK, MEASURED, UM, VERMILION, Margins, legend_below, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.identify.agreement import Agreement, EndAgreement

_PANEL_MM = 62


@styled
def orbits_against_simulated(found: Agreement, sense: int, runout: str) -> Figure:
    """Draw the orbits with the fitted clearance circle, one row per end.

    `sense` is that of rotation, +1 counter-clockwise; `runout` states whether it is compensated (`tdbmon.record.slow_roll`).
    """
    note = f"Orbits from the fitted bearing centres · not filtered · circle: fitted radial gap · {runout}"
    figure = new_figure(24 + _PANEL_MM * len(found.ends), note)
    axes = subplots(figure, len(found.ends), 2, Margins(15, 3, 14, 16, across=15, down=17))
    last = float(found.time[-1])
    spans = (
        (f"to {found.fitted_to * 1e3:.0f} ms: fitted", 0.0, found.fitted_to),
        (f"{found.fitted_to * 1e3:.0f} to {last * 1e3:.0f} ms: not fitted", found.fitted_to, last),
    )
    for row, end in zip(axes, found.ends.values(), strict=True):
        for ax, (words, start, stop) in zip(row, spans, strict=True):
            inside = (found.time >= start) & (found.time <= stop)
            _orbit(ax, end, inside, sense)
            ax.set_title(f"{end.end}, {words}")
    legend_below(figure, 4)
    return figure


def _orbit(ax: Axes, end: EndAgreement, inside: np.ndarray, sense: int) -> None:
    orbit_axes(ax)
    for path, colour, width, words in (
        (end.measured, MEASURED, 2.0, "measured"), (end.simulated, VERMILION, 0.8, "simulated")
    ):  # fmt: skip
        ax.plot(*(path[:, inside] * UM), color=colour, linewidth=width, label=words, rasterized=True)
    circle(ax, (0.0, 0.0), end.gap * UM, label="clearance circle")
    ax.plot(0, 0, "+", color=BLACK, markersize=5)
    reach = 1.08 * max(end.gap, float(np.nanmax(np.abs(end.measured))), float(np.abs(end.simulated).max())) * UM
    show_about(ax, (0.0, 0.0), reach)
    rotation_arrow(ax, sense, (0.0, 0.0), reach)
