"""Displacement against time at both ends, with the phases, the release, the contacts and the clearance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.figures.envelope import envelope_line
from tdbmon.figures.style import (
    AXIS_COLOUR,
    AXIS_WORD,
    BLACK,
    GREY,
    PURPLE,
    UM,
    Margins,
    legend_below,
    mark_phases,
    name_axis,
    new_figure,
    said,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis

_BINS = 1500
_TOUCHES_S = 2.0  # longest stretch in which touches are marked


@styled
def time_history(analysis: Analysis, start: float | None = None, stop: float | None = None) -> Figure:
    """Draw x and y of each end against time.

    Parameters
    ----------
    analysis : Analysis
        Analysis with displacement.
    start, stop : float, optional
        Stretch of the record, s; the whole of it by default.
    """
    planes = analysis.planes
    if planes is None:
        raise InputError("the record holds no displacement")
    time = planes.time.to_numpy()
    start, stop = float(time[0]) if start is None else start, float(time[-1]) if stop is None else stop
    inside = slice(*np.searchsorted(time, [start, stop]))
    thinned = inside.stop - inside.start > 2 * _BINS
    how = "least and greatest of each bin drawn" if thinned else "every sample drawn"
    ends = analysis.seen_ends
    figure = new_figure(16 + 23 * 2 * len(ends), said(analysis, "not filtered", how))
    axes = subplots(figure, 2 * len(ends), 1, Margins(17, 3, 10, 16, down=4), sharex=True)[:, 0]
    for i, end in enumerate(ends):
        for j, axis in enumerate(("y", "x")):
            ax = axes[2 * i + j]
            values = planes.displacement.sel(end=end, axis=axis).to_numpy()[inside] * UM
            ax.set_xlim(start, stop)
            mark_phases(ax, analysis, names=i == j == 0)
            ax.plot(
                *envelope_line(time[inside], values, _BINS),
                color=AXIS_COLOUR[axis],
                linewidth=0.7,
                rasterized=len(values) > 1200,
                label=AXIS_WORD[axis],
            )
            _clearance(ax, analysis, end, axis)
            _events(ax, analysis, end, start, stop)
            name_axis(ax, f"{{}} {axis} [µm]", end)
            ax.yaxis.set_label_coords(-11 / 150, 0.5)
            ax.margins(y=0.08)
    axes[-1].set_xlabel("time from the record's first sample [s]")
    legend_below(figure, 5)
    return figure


def shows_touches(start: float, stop: float) -> bool:
    """Whether a stretch is short enough to distinguish single touches."""
    return stop - start < _TOUCHES_S


def _clearance(ax: Axes, analysis: Analysis, end: str, axis: str) -> None:
    """Draw the limits of the clearance circle along this axis, about the clearance centre."""
    gap = analysis.ends[end].gap
    if gap is None:
        return
    middle = gap.place[0 if axis == "x" else 1]
    for sign, label in ((1, "clearance circle at static load"), (-1, None)):
        ax.axhline((middle + sign * gap.size) * UM, color=BLACK, linewidth=0.8, linestyle=(0, (4, 2)), label=label)


def _events(ax: Axes, analysis: Analysis, end: str, start: float, stop: float) -> None:
    release = analysis.released
    if release is not None and start <= release <= stop:
        ax.axvline(release, color=GREY, linewidth=0.8, label="release")
    shown = [c for c in analysis.ends[end].events if start <= c.start <= stop]
    if shown and shows_touches(start, stop):
        ax.plot(
            [c.start for c in shown],
            [0.0] * len(shown),
            marker="^",
            linestyle="none",
            markersize=4,
            color=PURPLE,
            transform=ax.get_xaxis_transform(),
            clip_on=False,
            label="contact begins",
        )
