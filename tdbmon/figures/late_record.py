"""The late record after trajectories have diverged: measured whirl and mean position, and those of many simulations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tdbmon.figures.drop_names import short_names
from tdbmon.figures.style import BLACK, BLUE, LIGHT, UM, Margins, legend_below, name_axis, new_figure, styled, subplots

if TYPE_CHECKING:
    from tdbmon.diagnosis.late_record import LateRecord

_BAND = (0.025, 0.5, 0.975)


@styled
def late_record(records: Sequence[LateRecord], shown: Sequence[int], probe: str) -> Figure:
    """Draw some drops side by side: 1X amplitude and mean reading of a probe against time, with the simulations' band.

    Parameters
    ----------
    records : sequence of LateRecord
    shown : sequence of int
        Indices of the drops to draw.
    probe : str
        Probe whose mean readings are drawn; all of these drops must have it.
    """
    figure = new_figure(96, "Means of 50 ms or three turns · 1X: root mean square over the probes")
    axes = subplots(figure, 2, len(shown), Margins(17, 3, 13, 20, across=4, down=4), sharex=True, sharey="row")
    names = short_names([records[drop].name for drop in shown])
    for column, (drop, name) in enumerate(zip(shown, names, strict=True)):
        each = records[drop]
        row = each.probes.index(probe)
        _compared(axes[0, column], each.time, each.whirl, each.whirls)
        _compared(axes[1, column], each.time, each.place[row], each.places[:, row])
        axes[0, column].set_title(name)
        axes[1, column].set_xlabel("time from the release [ms]")
    axes[0, 0].set_ylim(bottom=0.0)
    axes[0, 0].set_ylabel("1X, 0-pk [µm]")
    name_axis(axes[1, 0], "mean of {} [µm]", probe)
    legend_below(figure, 3)
    return figure


def _compared(
    ax: Axes, time: NDArray[np.float64], measured: NDArray[np.float64], simulated: NDArray[np.float64]
) -> None:
    low, middle, high = np.quantile(simulated, _BAND, axis=0) * UM
    ax.fill_between(time * 1e3, low, high, color=LIGHT, linewidth=0, label="simulated, 95 %")
    ax.plot(time * 1e3, middle, color=BLUE, label="simulated, median")
    ax.plot(time * 1e3, measured * UM, color=BLACK, marker="o", markersize=2.5, label="measured")
