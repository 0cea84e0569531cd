"""How speed and motion die out over a whole coast-down, measured and simulated."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
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
_LEAST_HZ = 1e-3  # on a logarithmic axis: less is standstill


@styled
def coast_down(course: Course, runout: str) -> Figure:
    """Draw speed, its difference, and the rms of x and y of each end, in windows of a second.

    `runout` says what became of it in both records.
    """
    ends = list(course.measured_rms)
    figure = new_figure(74 + 30 * len(ends), f"Mean and rms over windows of 1 s · displacement not filtered, {runout}")
    axes = subplots(
        figure, 2 + len(ends), 2, Margins(19, 3, 11, 18, across=15, down=4), height_ratios=[1.3, 1.0] + [1.3] * len(ends),
        sharex=True,
    )  # fmt: skip
    time = course.time
    both = ((course.measured_speed, MEASURED, 2.4, "measured"), (course.simulated_speed, VERMILION, 0.9, "simulated"))
    for column, scale in enumerate(("linear", "log")):
        top, below = axes[0, column], axes[1, column]
        for speed, colour, width, words in both:
            shown = np.where(speed >= _LEAST_HZ, speed, np.nan) if scale == "log" else speed
            top.plot(time, shown, color=colour, linewidth=width, label=words)
        if scale == "log":
            top.set_yscale("log")
            power_ticks(top.yaxis)
        top.set_title("speed" if scale == "linear" else "speed, logarithmic")
        left = course.simulated_speed - course.measured_speed
        if scale == "log":
            left = 100 * left / np.where(course.measured_speed > 0, course.measured_speed, np.nan)
        below.plot(time, left, color=VERMILION)
        below.set_ylabel("speed error\n[Hz]" if scale == "linear" else "speed error\n[%]")
        if scale == "log":
            below.set_ylim(*_percent_shown(course, left))
        top.set_ylabel("speed [Hz]")
    for row, end in enumerate(ends, start=2):
        for column, axis in enumerate("xy"):
            ax = axes[row, column]
            for rms, (_, colour, width, words) in zip((course.measured_rms, course.simulated_rms), both, strict=True):
                if end in rms:
                    ax.semilogy(time, rms[end][column] * UM, color=colour, linewidth=width, label=words)
            power_ticks(ax.yaxis)
            name_axis(ax, f"{{}} {axis} [µm rms]", end)
    for ax in axes[-1]:
        ax.set_xlabel("time from the release [s]")
        ax.set_xlim(0, time[-1] + 0.5)
    legend_below(figure)
    return figure


def _percent_shown(course: Course, left: Array) -> tuple[float, float]:
    """Return the limits of the speed error in percent: all of it where the rotor still turns well, and no less than usual."""
    turning = left[course.turning & np.isfinite(left)]
    low, high = _USUAL_PERCENT
    return min(low, 1.1 * float(turning.min(initial=0.0))), max(high, 1.1 * float(turning.max(initial=0.0)))
