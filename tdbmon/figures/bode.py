"""Bode and polar plots of 1X through the run-down."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.estimate import Z95
from tdbmon.figures.labels import Labels, Place
from tdbmon.figures.orbit_axes import show_about
from tdbmon.figures.style import (
    AXIS_COLOUR,
    AXIS_WORD,
    BLACK,
    GREEN,
    GREY,
    MEASURED,
    UM,
    Margins,
    legend_below,
    new_figure,
    said,
    say,
    styled,
    subplots,
)

if TYPE_CHECKING:
    import xarray as xr

    from tdbmon.analysis.result import Analysis

_BINS = 2.0  # half-power bandwidth of the order filter in bins of its window (Blackman-Harris)
_SEEN = 3.0  # least amplitude, in standard deviations, for its phase to be drawn
_FEWEST = 2  # least significant values for a polar plot
_MARKED_HZ = 20.0  # interval of the speeds labelled in the polar plot
_NAMED = 0.12  # of the greatest circle: smaller ones crowd at the origin and are not labelled
# candidate label offsets about a point of the polar plot, in typographic points: near it, then farther away
_ABOUT = [
    ((away * x, away * y), "left" if x > 0 else "right", "bottom" if y > 0 else "top")
    for away in (3.0, 8.0) for x, y in ((1, 1), (-1, 1), (1, -1), (-1, -1))
]  # fmt: skip


@styled
def bode(analysis: Analysis) -> Figure:
    """Draw amplitude and phase lag of 1X against speed, and the forward circle as a polar plot.

    Raises
    ------
    InputError
        If 1X was not tracked (`tracked_1x`).
    """
    first = tracked_1x(analysis)
    ends = analysis.seen_ends
    polar = has_polar(first.sel(end=ends))
    height, ratios = (166, [1, 0.8, 1.8]) if polar else (92, [1, 0.8])
    figure = new_figure(height, said(analysis, "1X tracked over shaft angle", "phase lag positive against rotation"))
    axes = subplots(figure, len(ratios), len(ends), Margins(15, 3, 11, 16, across=17, down=15), ratios)
    for column, end in enumerate(ends):
        amplitude, lag = axes[:2, column]
        part = first.sel(end=end)
        lag.sharex(amplitude)
        _amplitude(amplitude, part)
        _lag(lag, part)
        amplitude.set_title(f"{end}: 1X")
        if polar:
            _polar(axes[2, column], part)
            axes[2, column].set_title(f"{end}: forward circle of 1X")
    legend_below(figure, 4)
    return figure


def tracked_1x(analysis: Analysis) -> xr.Dataset:
    """Return the tracked 1X of all ends.

    Raises
    ------
    InputError
        If 1X was not tracked (without a keyphasor there is no phase), or if the speed changes by less than the resolution of a
        window: such a plot would show the noise at one speed.
    """
    tracks = analysis.tracks
    if tracks is None:
        raise InputError("the record holds no keyphasor pulses, so the phase is not known")
    if tracks.sizes["time"] < 2:
        raise InputError("the keyphasor covers fewer than 16 revolutions")
    first = tracks.sel(order=1.0)
    if not np.isfinite(first.amplitude).any():
        raise InputError("every window of 1X has missing samples")
    revolutions = tracks.attrs["window_revolutions"]
    high, low = float(first.speed.max()), float(first.speed.min())
    width = _BINS / revolutions * high
    if high - low < width:
        raise InputError(
            f"the speed changes by only {high - low:.2g} Hz in the record, less than the resolution of {width:.2g} Hz of a window"
            f" of {revolutions} revolutions; a longer record is needed"
        )
    return first


def has_polar(first: xr.Dataset) -> bool:
    """Whether the forward circle of 1X exceeds the noise at any end, so that a polar plot is useful."""
    return bool((_clear(first).sum("time") >= _FEWEST).any())


def _clear(first: xr.Dataset) -> xr.DataArray:
    """Return where the forward circle exceeds the noise."""
    return first.forward > _SEEN * first.forward_sigma


def _amplitude(ax: Axes, part: xr.Dataset) -> None:
    speed = part.speed.to_numpy()
    for axis in ("x", "y"):
        value, sigma = (part[name].sel(axis=axis).to_numpy() * UM for name in ("amplitude", "sigma"))
        ax.plot(speed, value, color=AXIS_COLOUR[axis], label=f"{AXIS_WORD[axis]}, with 95 % band")
        ax.fill_between(speed, np.maximum(value - Z95 * sigma, 0), value + Z95 * sigma, color=AXIS_COLOUR[axis],
                        alpha=0.2, linewidth=0, rasterized=True)  # fmt: skip
    ax.set_ylabel("amplitude [µm 0-pk]")
    upper = ((part.amplitude + Z95 * part.sigma) * UM).to_numpy()
    if np.isfinite(upper).any():
        ax.set_ylim(0, 1.05 * float(np.nanmax(upper)))


def _lag(ax: Axes, part: xr.Dataset) -> None:
    speed = part.speed.to_numpy()
    ax.set_xlabel("speed [Hz]")
    ax.set_ylabel("phase lag [°]")
    for axis in ("x", "y"):
        value, sigma, lag = (part[name].sel(axis=axis).to_numpy() for name in ("amplitude", "sigma", "lag"))
        clear = value > _SEEN * sigma
        degrees = np.rad2deg(np.mod(lag, 2 * np.pi))
        ax.plot(speed[clear], degrees[clear], ".", color=AXIS_COLOUR[axis], markersize=2.2, rasterized=True)
    if not (part.amplitude > _SEEN * part.sigma).any():
        say(ax, "no amplitude exceeds the noise")
    ax.set_ylim(0, 360)
    ax.set_yticks([0, 90, 180, 270, 360])


def _polar(ax: Axes, part: xr.Dataset) -> None:
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel("in phase with the mark [µm 0-pk]")
    ax.set_ylabel("90° ahead of it [µm 0-pk]")
    value, lag = (part[name].to_numpy() for name in ("forward", "forward_lag"))
    speed = part.speed.to_numpy()
    clear = _clear(part).to_numpy()
    if clear.sum() < _FEWEST:
        say(ax, "1X does not exceed the noise")
        return
    x, y = value * np.cos(lag) * UM, -value * np.sin(lag) * UM
    # insignificant values are drawn too: where a swing crosses 1X the circle is greatest and least certain
    ax.plot(x, y, ".-", color=MEASURED, markersize=2.5, linewidth=0.5, label="below 3 standard deviations")
    ax.plot(np.where(clear, x, np.nan), np.where(clear, y, np.nan), ".-", color=GREEN, markersize=2.5, linewidth=0.6,
            label="forward circle")  # fmt: skip
    reach = 1.2 * float(np.nanmax(np.hypot(x, y)))
    ax.axhline(0, color=GREY, linewidth=0.5)
    ax.axvline(0, color=GREY, linewidth=0.5)
    ax.plot(0, 0, "+", color=BLACK, markersize=6)
    show_about(ax, (0.0, 0.0), reach)
    _name_speeds(ax, x, y, speed, clear)


def _name_speeds(ax: Axes, x: np.ndarray, y: np.ndarray, speed: np.ndarray, clear: np.ndarray) -> None:
    """Label the speeds of the greatest circle and of the greatest significant one, and round speeds if there is room."""
    size = np.hypot(x, y)
    greatest = int(np.nanargmax(size))
    known = np.isfinite(size)
    low, high = float(speed[known].min()), float(speed[known].max())
    round_ones = np.arange(np.ceil(low / _MARKED_HZ), np.floor(high / _MARKED_HZ) + 1) * _MARKED_HZ
    marked = [greatest, int(np.argmax(np.where(clear, size, 0.0)))]
    for mark in round_ones:
        at = int(np.argmin(np.where(known, np.abs(speed - mark), np.inf)))
        if size[at] > _NAMED * size[greatest]:
            marked.append(at)
    labels = Labels(ax, {"fontsize": 6.5, "color": BLACK}, must=False)
    for at in dict.fromkeys(marked):
        if labels.write(f"{speed[at]:.0f} Hz", [Place(float(x[at]), float(y[at]), *side) for side in _ABOUT]):
            ax.plot(x[at], y[at], "o", color=BLACK, markersize=2.2, zorder=4)
