"""The shaft centreline: the mean position, from levitation through the run-down to rest, in the clearance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from tdbmon.analysis import orbit
from tdbmon.figures.style import (
    BLACK,
    GREEN,
    GREY,
    UM,
    Margins,
    centre_of,
    colour_bar,
    new_figure,
    released,
    said,
    say,
    seen_ends,
    styled,
    subplots,
)

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.collections import PathCollection

    from tdbmon.analysis.result import Analysis

_WINDOW_S = 0.2
_POINTS = 400


@styled
def centreline(analysis: Analysis) -> Figure:
    """Draw mean positions over windows, coloured by speed: in the clearance circle above, magnified below."""
    ends = seen_ends(analysis)
    figure = new_figure(125, said(analysis, f"mean over {_WINDOW_S:g} s"))
    axes = subplots(figure, 2, len(ends), Margins(16, 24, 11, 11, across=18, down=17))
    path, shown = _path(analysis), None
    for column, end in enumerate(ends):
        shown = _end(axes[:, column], analysis, path, end, shown) or shown
    if shown is not None:
        by_speed = len(analysis.speed_time) > 3
        colour_bar(figure, shown, "speed [Hz]" if by_speed else "time [s]")
    return figure


def _end(
    axes: np.ndarray, analysis: Analysis, path: xr.Dataset | None, end: str, like: PathCollection | None
) -> PathCollection | None:
    whole, near = axes
    for ax, title in ((whole, "clearance"), (near, "from settling on, magnified")):
        ax.set_title(f"{end}: {title}")
        ax.set_xlabel("x (right) [µm]")
        ax.set_ylabel("y (up) [µm]")
        ax.set_aspect("equal", adjustable="box")
    centre = centre_of(analysis, end) * UM
    gap = analysis.ends[end].gap
    if gap is None or gap.radius.value is None or path is None:
        say(whole, "no clearance circle is known")
        say(near, "no clearance circle is known")
        return None
    radius = gap.radius.value * UM
    time, mean = _means(path, end)
    settled = time - _WINDOW_S / 2 >= gap.settled_from
    for ax in (whole, near):
        ax.add_patch(Circle(tuple(centre), radius, fill=False, color=BLACK, linewidth=0.9))
    whole.set_xlim(centre[0] - 1.15 * radius, centre[0] + 1.15 * radius)
    whole.set_ylim(centre[1] - 1.15 * radius, centre[1] + 1.15 * radius)
    whole.plot(*centre, "+", color=BLACK, markersize=7)
    colour = _colour(analysis, time)
    shown = _scatter(whole, mean, colour, like)
    if analysis.release is not None and end in analysis.release.levitated:
        x, y = analysis.release.levitated[end]
        whole.plot(x * UM, y * UM, "D", color=GREEN, markersize=4)
        whole.annotate(
            "levitated", (x * UM, y * UM), xytext=(4, 4), textcoords="offset points", color=GREEN, fontsize=7
        )
    if settled.sum() < 2:
        say(near, "too short to show a course")
        return shown
    _scatter(near, mean[settled], colour[settled], shown)
    low, high = mean[settled].min(axis=0), mean[settled].max(axis=0)
    middle, reach = (low + high) / 2, 0.65 * float(max(high - low)) + 0.2
    near.set_xlim(middle[0] - reach, middle[0] + reach)
    near.set_ylim(middle[1] - reach, middle[1] + reach)
    near.annotate("clearance circle: black", (0.02, 0.03), xycoords="axes fraction", fontsize=6.5, color=GREY)
    return shown


def _scatter(ax: Axes, mean: np.ndarray, colour: np.ndarray, like: PathCollection | None = None) -> PathCollection:
    shown = ax.scatter(mean[:, 0], mean[:, 1], c=colour, cmap="viridis", s=6, linewidths=0, rasterized=True, zorder=3)
    if like is not None:
        shown.set_clim(*like.get_clim())
    return shown


def _path(analysis: Analysis) -> xr.Dataset | None:
    """Mean positions from the release on; None where the record ends within two windows of it."""
    planes = analysis.planes
    if planes is None:
        return None
    after = planes.sel(time=slice(released(analysis), None))
    if after.sizes["time"] < 2 * _WINDOW_S * planes.attrs["sampling_hz"]:
        return None
    return orbit.centreline(after, _WINDOW_S)


def _means(path: xr.Dataset, end: str) -> tuple[np.ndarray, np.ndarray]:
    """Middle times (n,) and mean positions (n, 2), µm, of the windows without a missing sample, thinned."""
    time, mean = path.time.to_numpy(), path.position.sel(end=end).to_numpy().T * UM
    whole = np.isfinite(mean).all(axis=1)
    thin = max(1, int(whole.sum()) // _POINTS)
    return time[whole][::thin], mean[whole][::thin]


def _colour(analysis: Analysis, time: np.ndarray) -> np.ndarray:
    if len(analysis.speed_time) > 3:
        return np.interp(time, analysis.speed_time, analysis.speed_hz)
    return time
