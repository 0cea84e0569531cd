"""Heat map of the residual relative to the noise: one row per probe and drop, against time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from tdbmon.figures.style import GREY, Margins, clipped, colour_bar, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.diagnosis.left_over import LeftOver

_BIN_S = 5e-4
_ROW_MM = 3.2
_LETTERS = 12  # longest name of a probe
_LEAST = 10.0  # least top of the colour scale, times the noise


@styled
def residual_map(models: Mapping[str, Sequence[LeftOver]]) -> Figure:
    """Draw the whitened rms of every probe of every drop in bins of half a millisecond, one panel per model."""
    drops = next(iter(models.values()))
    rows = sum(len(left.probes) for left in drops)
    note = "rms of the whitened residual, in units of the noise: 1 for noise alone · bins of 0.5 ms"
    panels = {name: [_binned(left) for left in lefts] for name, lefts in models.items()}
    if any(np.isnan(values).any() for each in panels.values() for _, values in each):
        note += " · blank: not measured"
    figure = new_figure(26 + _ROW_MM * rows, note)
    axes = subplots(figure, 1, len(models), Margins(30, 22, 15, 11, across=5), sharey=True)[0]
    highest = max(float(np.nanmax(values)) for each in panels.values() for _, values in each)
    norm = LogNorm(1.0, max(highest, _LEAST))
    image = None
    for ax, (name, binned) in zip(axes, panels.items(), strict=True):
        top = 0
        for edges, values in binned:
            shown = np.maximum(values, 1.0)
            image = ax.pcolormesh(
                edges * 1e3, np.arange(top, top + len(values) + 1), shown, norm=norm, cmap="magma_r", rasterized=True
            )
            top += len(values)
            ax.axhline(top, color=GREY, linewidth=0.6)
        ax.axvline(0, color=GREY, linewidth=0.8)
        ax.set_ylim(rows, 0)
        ax.grid(False)
        ax.set_title(name)
        ax.set_xlabel("time from the release [ms]")
    names = [f"{left.speed:.0f} Hz {clipped(probe.name, _LETTERS)}" for left in drops for probe in left.probes]
    axes[0].set_yticks(np.arange(rows) + 0.5, names, fontsize=6)
    axes[0].set_ylabel("drop [Hz], probe")
    axes[0].yaxis.set_label_coords(-27 / 118 * len(models), 0.5)
    if image is not None:
        colour_bar(figure, image, "times the noise [–]")
        figure.axes[-1].yaxis.set_major_formatter("{x:g}")
        figure.axes[-1].yaxis.set_minor_formatter(NullFormatter())
    return figure


def _binned(left: LeftOver) -> tuple[np.ndarray, np.ndarray]:
    """Return bin edges (b + 1,) in s, one of them the release, and the rms in the bins, (probes, b); NaN for empty bins."""
    begin = np.floor(left.time[0] / _BIN_S)
    bins = (np.floor(left.time / _BIN_S) - begin).astype(int)
    bins_of_all = int(bins[-1]) + 1
    rms = np.full((len(left.probes), bins_of_all), np.nan)
    for out, row in zip(rms, left.whitened, strict=True):
        there = np.isfinite(row)
        count = np.bincount(bins[there], minlength=bins_of_all)
        square = np.bincount(bins[there], weights=row[there] ** 2, minlength=bins_of_all)
        out[count > 0] = np.sqrt(square[count > 0] / count[count > 0])
    return (begin + np.arange(bins_of_all + 1)) * _BIN_S, rms
