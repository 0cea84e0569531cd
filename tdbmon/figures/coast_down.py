"""Decay of speed and motion over a whole coast-down, measured and simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tdbmon.figures.style import (
    MEASURED,
    UM,
    VERMILION,
    Margins,
    legend_below,
    name_axis,
    new_figure,
    power_ticks,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.identify.coast_down_comparison import Course

Array = NDArray[np.float64]

_USUAL_PERCENT = -5.0, 25.0  # of the measured speed
_MEASURED: dict[str, Any] = {"color": MEASURED, "linewidth": 2.4, "label": "measured"}
_SIMULATED: dict[str, Any] = {"color": VERMILION, "linewidth": 0.9, "label": "simulated"}
_LEAST_HZ = 1e-3  # least speed on a logarithmic axis: below is standstill


@styled
def coast_down(course: Course, runout: str) -> Figure:
    """Draw measured and simulated speed, their difference, and the rms of x and y of each end, in windows of one second.

    `runout` states whether run-out is compensated in both records.
    """
    ends = list(course.measured_rms)
    figure = new_figure(74 + 30 * len(ends), f"Mean and rms over windows of 1 s · displacement not filtered, {runout}")
    axes = subplots(
        figure, 2 + len(ends), 2, Margins(19, 3, 11, 18, across=15, down=4), height_ratios=[1.3, 1.0] + [1.3] * len(ends),
        sharex=True,
    )  # fmt: skip
    error = course.simulated_speed - course.measured_speed
    percent = 100 * error / np.where(course.measured_speed > 0, course.measured_speed, np.nan)
    _speeds(axes[0, 0], course, "speed")
    _error(axes[1, 0], course, error, "Hz")
    _speeds(axes[0, 1], course, "speed, logarithmic", least=_LEAST_HZ)
    axes[0, 1].set_yscale("log")
    power_ticks(axes[0, 1].yaxis)
    _error(axes[1, 1], course, percent, "%")
    axes[1, 1].set_ylim(*_percent_shown(course, percent))
    for row, end in enumerate(ends, start=2):
        for column, axis in enumerate("xy"):
            ax = axes[row, column]
            for rms, look in ((course.measured_rms, _MEASURED), (course.simulated_rms, _SIMULATED)):
                if end in rms:
                    ax.semilogy(course.time, rms[end][column] * UM, **look)
            power_ticks(ax.yaxis)
            name_axis(ax, f"{{}} {axis} [µm rms]", end)
    for ax in axes[-1]:
        ax.set_xlabel("time from the release [s]")
        ax.set_xlim(0, course.time[-1] + 0.5)
    legend_below(figure)
    return figure


def _speeds(ax: Axes, course: Course, title: str, least: float = -np.inf) -> None:
    """Draw both speeds where they are at least `least`, Hz."""
    for speed, look in ((course.measured_speed, _MEASURED), (course.simulated_speed, _SIMULATED)):
        ax.plot(course.time, np.where(speed >= least, speed, np.nan), **look)
    ax.set_title(title)
    ax.set_ylabel("speed [Hz]")


def _error(ax: Axes, course: Course, error: Array, unit: str) -> None:
    ax.plot(course.time, error, color=VERMILION)
    ax.set_ylabel(f"speed error\n[{unit}]")


def _percent_shown(course: Course, left: Array) -> tuple[float, float]:
    """Return the axis limits of the speed error, %: the usual ones, extended to the errors while the rotor still turns."""
    turning = left[course.turning & np.isfinite(left)]
    low, high = _USUAL_PERCENT
    return min(low, 1.1 * float(turning.min(initial=0.0))), max(high, 1.1 * float(turning.max(initial=0.0)))
