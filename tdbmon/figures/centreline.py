"""The shaft centreline: the levitated position, and the mean position in the clearance from the release to rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.analysis import orbit
from tdbmon.figures.orbit_axes import circle, orbit_axes, show_about
from tdbmon.figures.style import (
    BLACK,
    GREEN,
    TITLE_LETTERS,
    UM,
    Margins,
    centre_of,
    circled_ends,
    clipped,
    colour_bar,
    legend_below,
    new_figure,
    said,
    say,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis

Course = tuple[np.ndarray, np.ndarray]  # middle times, s, and mean positions, µm
Courses = dict[str, Course]

_WINDOW_S = 0.2
_LEAST_S = 2 * _WINDOW_S  # least time after the release for a course
_POINTS = 400
_FEWEST = 2  # least settled positions for a course


@styled
def centreline(analysis: Analysis) -> Figure:
    """Draw mean positions over windows, coloured by speed: in the clearance circle above, magnified below.

    Ends without a course are left out, and the lower row if no end is settled for long enough.

    Raises
    ------
    InputError
        As `courses_of`.
    """
    courses = courses_of(analysis)
    rows = 2 if any_settled(analysis, courses) else 1
    figure = new_figure(29 + 43 * rows + 17 * (rows - 1), said(analysis, f"mean over {_WINDOW_S:g} s"))
    axes = subplots(figure, rows, len(courses), Margins(16, 24, 11, 18, across=18, down=17))
    scale = Normalize()
    scale.autoscale(np.concatenate([_colour(analysis, time) for time, _ in courses.values()]))
    for column, (end, course) in enumerate(courses.items()):
        _whole(axes[0, column], analysis, end, course, scale)
        if rows > 1:
            _near(axes[1, column], analysis, end, course, scale)
    legend_below(figure)
    words = "speed [Hz]" if turns(analysis) else "time [s]"
    colour_bar(figure, ScalarMappable(scale, "viridis"), words)
    return figure


def turns(analysis: Analysis) -> bool:
    """Whether the rotor turns with known speed; else positions are coloured by time."""
    return analysis.has_speed and bool((analysis.speed_hz > 0).any())


def any_settled(analysis: Analysis, courses: Courses) -> bool:
    """Whether an end's settled course is long enough to be drawn magnified."""
    return any(_settled(analysis, end, time).sum() >= _FEWEST for end, (time, _) in courses.items())


def _whole(ax: Axes, analysis: Analysis, end: str, course: Course, scale: Normalize) -> None:
    """Draw the clearance circle with all positions."""
    ax.set_title(f"{end}: clearance")
    orbit_axes(ax)
    centre, radius = _clearance(ax, analysis, end)
    show_about(ax, centre, 1.15 * radius)
    ax.plot(*centre, "+", color=BLACK, markersize=7, label="centre")
    _scatter(ax, analysis, *course, scale)
    if analysis.release is not None and end in analysis.release.states:
        x, y = analysis.release.states[end].levitated
        ax.plot(x * UM, y * UM, "D", color=GREEN, markersize=4, label="levitated")


def _near(ax: Axes, analysis: Analysis, end: str, course: Course, scale: Normalize) -> None:
    """Draw the settled positions alone."""
    ax.set_title(f"{clipped(end, TITLE_LETTERS)}: after settling, magnified")
    orbit_axes(ax)
    time, mean = course
    settled = _settled(analysis, end, time)
    if settled.sum() < _FEWEST:
        say(ax, f"settled for less than {_FEWEST * _WINDOW_S:g} s")
        return
    _clearance(ax, analysis, end)
    _scatter(ax, analysis, time[settled], mean[settled], scale)
    low, high = mean[settled].min(axis=0), mean[settled].max(axis=0)
    show_about(ax, (low + high) / 2, 0.65 * float(max(high - low)) + 0.2)


def _clearance(ax: Axes, analysis: Analysis, end: str) -> tuple[np.ndarray, float]:
    """Draw the clearance circle of an end that has one; return its centre and radius, µm."""
    gap, centre = analysis.ends[end].gap, centre_of(analysis, end) * UM
    radius = 0.0 if gap is None else gap.size * UM
    circle(ax, centre, radius, label="clearance circle")
    return centre, radius


def _scatter(ax: Axes, analysis: Analysis, time: np.ndarray, mean: np.ndarray, scale: Normalize) -> None:
    colour = _colour(analysis, time)
    ax.scatter(
        mean[:, 0], mean[:, 1], c=colour, cmap="viridis", norm=scale, s=6, linewidths=0, rasterized=True, zorder=3
    )


def courses_of(analysis: Analysis) -> Courses:
    """Return centre times (n,), s, and mean positions (n, 2), µm, of each end with a circle, from the release on.

    Only windows without missing samples are used, thinned.

    Raises
    ------
    InputError
        If no end has both a clearance circle and two windows after the release.
    """
    found: Courses = {}
    after = None if analysis.planes is None else analysis.planes.sel(time=slice(analysis.released, None))
    if after is not None and after.sizes["time"] >= _LEAST_S * after.attrs["sampling_hz"]:
        path = orbit.centreline(after, _WINDOW_S)
        for end in circled_ends(analysis):
            time, mean = path.time.to_numpy(), path.position.sel(end=end).to_numpy().T * UM
            whole = np.isfinite(mean).all(axis=1)
            if whole.any():
                thin = max(1, int(whole.sum()) // _POINTS)
                found[end] = time[whole][::thin], mean[whole][::thin]
    if not found:
        raise InputError(f"no end has both a clearance circle and {_LEAST_S:g} s after the release")
    return found


def _settled(analysis: Analysis, end: str, time: np.ndarray) -> np.ndarray:
    """Return a mask of the windows that lie wholly after the last bounce."""
    gap = analysis.ends[end].gap
    return np.zeros(len(time), bool) if gap is None else time - _WINDOW_S / 2 >= gap.settled_from


def _colour(analysis: Analysis, time: np.ndarray) -> np.ndarray:
    return np.interp(time, analysis.speed_time, analysis.speed_hz) if turns(analysis) else time
