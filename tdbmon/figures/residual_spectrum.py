"""Full spectra of the residual, against frequency and against orders of rotation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.drop_names import short_names
from tdbmon.figures.style import (
    GREY,
    UM,
    Margins,
    drop_look,
    legend_below,
    legend_room,
    name_axis,
    name_between,
    new_figure,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.diagnosis.left_over import Spectrum

_HIGHEST_HZ, _HIGHEST_ORDER = 800.0, 6.0
_COLUMNS = 4  # of the legend


@styled
def residual_spectrum(spectra: Sequence[Spectrum]) -> Figure:
    """Draw spectra of the plain model's residual of each drop, one row per end: against frequency on the left, where peaks of
    constant frequency coincide, and against order on the right, where those of constant order do."""
    ends = list(dict.fromkeys(each.end for each in spectra))
    widest = max(each.resolution for each in spectra)
    note = f"Measured less plain model, from the release on · Hann window · resolution {widest:.0f} Hz · 0-pk"
    drops = list(dict.fromkeys(each.drop for each in spectra))
    names = short_names(drops)
    more = legend_room(len(drops), _COLUMNS, 2)
    figure = new_figure(20 + more + 50 * len(ends), note)
    axes = subplots(figure, len(ends), 2, Margins(15, 3, 10, 20 + more, across=6, down=11), sharey="row")
    for each in spectra:
        drop = drops.index(each.drop)
        colour, line = drop_look(drop)
        row = axes[ends.index(each.end)]
        level = each.threshold * each.noise * UM
        for ax, scale, highest in zip(row, (1.0, each.speed), (_HIGHEST_HZ, _HIGHEST_ORDER), strict=True):
            if not scale:  # at standstill there are no orders
                continue
            at = each.frequency / scale
            inside = np.abs(at) <= highest
            ax.plot(
                at[inside], each.amplitude[inside] * UM, color=colour, linestyle=line,
                label=f"{names[drop]}, {each.speed:.0f} Hz",
            )  # fmt: skip
            ax.plot(at[inside], level[inside], color=colour, linestyle=":", linewidth=0.7)
    for end, row in zip(ends, axes, strict=True):
        name_axis(row[0], "{} amplitude [µm 0-pk]", end)
        for ax in row:
            ax.set_yscale("log")
            ax.yaxis.set_major_formatter("{x:g}")
            name_between(ax.yaxis)
            ax.axvline(0, color=GREY, linewidth=0.6)
        row[0].set_xlabel("backward   ←   frequency [Hz]   →   forward")
        row[1].set_xlabel("backward   ←   order of rotation [–]   →   forward")
        row[1].set_xticks(np.arange(-_HIGHEST_ORDER, _HIGHEST_ORDER + 1))
    legend_below(figure, _COLUMNS)
    return figure
