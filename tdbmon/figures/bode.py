"""Bode and polar plots of 1X through the run-down."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.figures.style import (
    AXIS_COLOUR,
    AXIS_WORD,
    BLACK,
    GREEN,
    GREY,
    UM,
    Margins,
    legend_below,
    new_figure,
    said,
    say,
    seen_ends,
    styled,
    subplots,
)

if TYPE_CHECKING:
    import xarray as xr

    from tdbmon.analysis.result import Analysis

_SEEN = 3.0  # standard deviations that an amplitude must have for its phase to be drawn
_MARKED_HZ = 20.0  # speeds named in the polar plot


@styled
def bode(analysis: Analysis) -> Figure:
    """Draw amplitude and phase lag of 1X against speed, and the forward circle as a polar plot.

    Raises
    ------
    InputError
        If the orders were not tracked: without a keyphasor there is no phase.
    """
    tracks = analysis.tracks
    if tracks is None or tracks.sizes["time"] < 2:
        raise InputError("1X was not tracked: it needs a keyphasor over at least 16 revolutions")
    first = tracks.sel(order=1.0)
    if not np.isfinite(first.amplitude).any():
        raise InputError("1X was not tracked: no window of it has all its samples")
    ends = seen_ends(analysis)
    figure = new_figure(150, said(analysis, "1X tracked over shaft angle", "phase lag positive against rotation"))
    axes = subplots(figure, 3, len(ends), Margins(15, 3, 11, 16, across=17, down=14), [1, 0.8, 1.5])
    for column, end in enumerate(ends):
        amplitude, lag, polar = axes[:, column]
        part = first.sel(end=end)
        _amplitude(amplitude, part)
        _lag(lag, part)
        _polar(polar, part)
        amplitude.set_title(f"{end}: 1X")
        polar.set_title(f"{end}: forward circle of 1X")
        lag.sharex(amplitude)
    legend_below(figure)
    return figure


def _amplitude(ax: Axes, part: xr.Dataset) -> None:
    speed = part.speed.to_numpy()
    for axis in ("x", "y"):
        value, sigma = (part[name].sel(axis=axis).to_numpy() * UM for name in ("amplitude", "sigma"))
        ax.plot(speed, value, color=AXIS_COLOUR[axis], label=f"{AXIS_WORD[axis]}, with 95 % band")
        ax.fill_between(speed, np.maximum(value - 1.96 * sigma, 0), value + 1.96 * sigma, color=AXIS_COLOUR[axis],
                        alpha=0.2, linewidth=0, rasterized=True)  # fmt: skip
    ax.set_ylabel("amplitude [µm 0-pk]")
    if np.isfinite(part.amplitude).any():
        ax.set_ylim(0, 1.15 * float(np.nanquantile(part.amplitude.to_numpy(), 0.995)) * UM)


def _lag(ax: Axes, part: xr.Dataset) -> None:
    speed = part.speed.to_numpy()
    ax.set_xlabel("speed [Hz]")
    ax.set_ylabel("phase lag [°]")
    for axis in ("x", "y"):
        value, sigma, lag = (part[name].sel(axis=axis).to_numpy() for name in ("amplitude", "sigma", "lag"))
        clear = value > _SEEN * sigma
        degrees = np.rad2deg(np.mod(lag, 2 * np.pi))
        ax.plot(speed[clear], degrees[clear], ".", color=AXIS_COLOUR[axis], markersize=2.2, rasterized=True)
    ax.set_ylim(0, 360)
    ax.set_yticks([0, 90, 180, 270, 360])


def _polar(ax: Axes, part: xr.Dataset) -> None:
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel("in phase with the mark [µm 0-pk]")
    ax.set_ylabel("90° ahead of it [µm 0-pk]")
    value, sigma, lag = (part[name].to_numpy() for name in ("forward", "forward_sigma", "forward_lag"))
    speed = part.speed.to_numpy()
    clear = np.isfinite(value) & (value > _SEEN * sigma)
    if clear.sum() < 2:
        say(ax, "1X does not stand out of the noise")
        return
    x, y = value * np.cos(lag) * UM, -value * np.sin(lag) * UM
    ax.plot(np.where(clear, x, np.nan), np.where(clear, y, np.nan), ".-", color=GREEN, markersize=2.5, linewidth=0.6,
            label="forward circle, above 3 standard deviations")  # fmt: skip
    reach = 1.2 * float(np.max(np.hypot(x[clear], y[clear])))
    ax.axhline(0, color=GREY, linewidth=0.5)
    ax.axvline(0, color=GREY, linewidth=0.5)
    ax.plot(0, 0, "+", color=BLACK, markersize=6)
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    named: list[tuple[float, float]] = []
    for mark in (
        np.arange(np.ceil(speed[clear].min() / _MARKED_HZ), np.floor(speed[clear].max() / _MARKED_HZ) + 1) * _MARKED_HZ
    ):
        at = int(np.argmin(np.where(clear, np.abs(speed - mark), np.inf)))
        if any(np.hypot(x[at] - a, y[at] - b) < 0.14 * reach for a, b in named):
            continue
        named.append((float(x[at]), float(y[at])))
        ax.annotate(
            f"{mark:.0f} Hz", (x[at], y[at]), xytext=(3, 3), textcoords="offset points", fontsize=6.5, color=GREY
        )
