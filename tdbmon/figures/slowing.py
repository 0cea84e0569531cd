"""Shaft angle after trajectories have diverged, measured minus simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.diagnosis.evidence import PLAIN
from tdbmon.figures.drop_names import short_names
from tdbmon.figures.style import (
    BLUE,
    GREY,
    LIGHT,
    VERMILION,
    Margins,
    legend_below,
    new_figure,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.identify.slowing import Factors, Slowing


@styled
def slowing(
    models: Mapping[str, tuple[Factors, Sequence[Slowing]]], names: Sequence[str], shown: Sequence[int]
) -> Figure:
    """Draw the residual shaft angle of each model for some drops side by side.

    Parameters
    ----------
    models : mapping
        By the model's name, the scale factors of its simulated lag and drag, and its drops; at most two models.
    names : sequence of str
        Names of all drops.
    shown : sequence of int
        Indices of the drops to draw.
    """
    figure = new_figure(
        62, "Keyphasor less simulated shaft angle, forward, means of 20 ms · grey: two standard deviations"
    )
    axes = subplots(figure, 1, len(shown), Margins(17, 3, 13, 20, across=4), sharey="row")
    titles = short_names([names[drop] for drop in shown])
    for ax, drop, title in zip(axes[0], shown, titles, strict=True):
        for name, (factors, drops) in models.items():
            each = drops[drop]
            colour = VERMILION if name == PLAIN else BLUE
            if colour == VERMILION or len(models) == 1:
                band = 2 * np.degrees(each.sigma)
                ax.fill_between(each.time * 1e3, -band, band, color=LIGHT, linewidth=0, label="expected")
            ax.plot(
                each.time * 1e3, np.degrees(each.rest(factors)), color=colour, marker="o", markersize=2.5, label=name
            )
        ax.axhline(0, color=GREY, linewidth=0.6)
        ax.set_title(title)
        ax.set_xlabel("time from the release [ms]")
    axes[0, 0].set_ylabel("residual angle [°]")
    legend_below(figure, 3)
    return figure
