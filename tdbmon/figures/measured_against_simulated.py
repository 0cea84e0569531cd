"""Measured against simulated probe readings, with the residual below each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.diagnosis.evidence import PLAIN
from tdbmon.figures.drop_names import short_names
from tdbmon.figures.style import (
    BLUE,
    GREY,
    LIGHT,
    MEASURED,
    UM,
    VERMILION,
    Margins,
    legend_below,
    name_axis,
    new_figure,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.diagnosis.left_over import LeftOver

_PROBE_MM = 27


@styled
def measured_against_simulated(models: Mapping[str, Sequence[LeftOver]], shown: Sequence[int]) -> Figure:
    """Draw some drops side by side, a pair of rows per probe: readings above, measured minus simulated below.

    Parameters
    ----------
    models : mapping
        Residuals of every drop by the model's name; at most two models.
    shown : sequence of int
        Indices of the drops to draw.
    """
    first = next(iter(models.values()))
    names = list(dict.fromkeys(probe.name for drop in shown for probe in first[drop].probes))
    note = "Readings without hum and third harmonic · not filtered · residual: measured less simulated"
    figure = new_figure(30 + _PROBE_MM * len(names), note)
    axes = subplots(
        figure, 2 * len(names), len(shown), Margins(17, 3, 15, 18, across=4, down=2.5),
        height_ratios=[1.7, 1.0] * len(names), sharex=True, sharey="row",
    )  # fmt: skip
    drops = short_names([first[drop].name for drop in shown])
    for column, (drop, title) in enumerate(zip(shown, drops, strict=True)):
        left = first[drop]
        axes[0, column].set_title(f"{title}, {left.speed:.0f} Hz")
        for row, name in enumerate(names):
            _probe(axes[2 * row, column], axes[2 * row + 1, column], models, drop, name)
        axes[-1, column].set_xlabel("time from the release [ms]")
        axes[-1, column].set_xlim(left.time[0] * 1e3, left.time[-1] * 1e3)
    for row, name in enumerate(names):
        name_axis(axes[2 * row, 0], "{}\n[µm]", name)
        axes[2 * row + 1, 0].set_ylabel("residual\n[µm]")
        for ax in axes[2 * row : 2 * row + 2, 0]:
            ax.yaxis.set_label_coords(-10 * len(shown) / 150, 0.5)
    legend_below(figure, 4)
    return figure


def _probe(above: Axes, below: Axes, models: Mapping[str, Sequence[LeftOver]], drop: int, name: str) -> None:
    for k, (model, drops) in enumerate(models.items()):
        colour = VERMILION if model == PLAIN else BLUE
        left = drops[drop]
        row = next((i for i, probe in enumerate(left.probes) if probe.name == name), None)
        if row is None:
            continue
        time = left.time * 1e3
        if k == 0:
            above.plot(time, left.measured[row] * UM, color=MEASURED, linewidth=2.6, label="measured", rasterized=True)
            band = 2 * left.noise[row].sigma * UM
            below.axhspan(-band, band, color=LIGHT, linewidth=0, label="twice the noise")
            for ax in (above, below):
                ax.axvline(0, color=GREY, linewidth=0.6)
        above.plot(time, left.simulated[row] * UM, color=colour, linewidth=0.8, label=model, rasterized=True)
        below.plot(time, left.residual[row] * UM, color=colour, linewidth=0.7, rasterized=True)
