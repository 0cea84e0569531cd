"""Orders of rotation through a coast-down, measured and simulated, with the critical speeds of the resting rotor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.style import (
    GREY,
    MEASURED,
    UM,
    VERMILION,
    Margins,
    legend_below,
    name_axis,
    new_figure,
    power_ticks,
    say,
    styled,
    subplots,
)
from tdbmon.record.slow_roll import runout_words

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis
    from tdbmon.identify.coast_down import CoastDown
    from tdbmon.identify.coast_down_comparison import Resonance

_ORDERS = (1.0, 2.0)


@styled
def coast_down_orders(whole: CoastDown, resonances: Sequence[Resonance]) -> Figure:
    """Draw the greater of forward and backward circle of 1X and 2X against speed, one column per end."""
    ends = list(whole.measured.ends)
    runout = runout_words(whole.measured.checks)
    figure = new_figure(96, f"Greater of forward and backward circle, tracked over shaft angle · {runout}")
    axes = subplots(figure, len(_ORDERS), len(ends), Margins(17, 3, 11, 18, across=15, down=5), sharex=True)
    for row, order in zip(axes, _ORDERS, strict=True):
        for ax, end in zip(row, ends, strict=True):
            drawn = [
                _track(ax, whole.measured, order, end, MEASURED, 2.4, "measured"),
                _track(ax, whole.simulated, order, end, VERMILION, 0.9, "simulated"),
            ]
            ax.set_yscale("log")
            power_ticks(ax.yaxis)
            if not any(drawn):
                say(ax, "not tracked: it needs a keyphasor")
            for each in resonances:
                if each.order == order:
                    ax.axvline(
                        each.critical, color=GREY, linestyle=":", linewidth=1.0, label="computed critical speed"
                    )
            name_axis(ax, f"{{}} {order:g}X [µm 0-pk]", end)
    for ax in axes[-1]:
        ax.set_xlabel("speed [Hz]")
    legend_below(figure)
    return figure


def _track(ax: Axes, analysis: Analysis, order: float, end: str, colour: str, width: float, words: str) -> bool:
    tracks = analysis.tracks
    if tracks is None or order not in tracks.order.values or end not in tracks.end.values:
        return False
    part = tracks.sel(order=order, end=end)
    circle = np.fmax(part.forward.to_numpy(), part.backward.to_numpy()) * UM
    ax.plot(part.speed.to_numpy(), circle, color=colour, linewidth=width, label=words)
    return True
