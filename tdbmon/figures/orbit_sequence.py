"""Orbits of one end in successive panels from the release to the late run-down."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.orbit_axes import frame_orbit, keyphasor_dots, orbit_axes
from tdbmon.figures.style import (
    BLUE,
    GREEN,
    TITLE_LETTERS,
    UM,
    VERMILION,
    Margins,
    clipped,
    legend_below,
    new_figure,
    said,
    say,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis

_PANELS = 6
_PANEL_MM, _DOWN_MM = {1: 36.0, 2: 26.5}, 18.0  # height of a panel for one and for two rows
_WHIRL_TURNS = 4  # shown of the longest whirl: more would overlap
_DENSE = 500  # samples, above which the line is rasterised


@styled
def orbit_sequence(analysis: Analysis, end: str) -> Figure:
    """Draw up to six stretches of the orbit of an end with the clearance circle; small orbits are magnified and marked so."""
    spans = _spans(analysis, end)
    # four panels form two rows of two
    columns = min(len(spans), 3) if len(spans) != 4 else 2
    rows = -(-len(spans) // columns)
    notes = ["not filtered"] if analysis.angle is not None else ["not filtered", "no keyphasor: no dots"]
    figure = new_figure(30 + _PANEL_MM[rows] * rows + _DOWN_MM * (rows - 1), said(analysis, *notes))
    axes = subplots(figure, rows, columns, Margins(15, 2, 14, 16, across=15, down=_DOWN_MM)).ravel()
    for ax, (name, start, stop) in zip(axes, spans, strict=False):
        _orbit(ax, analysis, end, name, start, stop)
    for ax in axes[len(spans) :]:
        ax.set_axis_off()
    legend_below(figure, 5)
    return figure


def _spans(analysis: Analysis, end: str) -> list[tuple[str, float, float]]:
    """Return name, start and end (s) of the stretches available in the record."""
    if analysis.planes is None:
        return []
    time = analysis.planes.time.to_numpy()
    first, last = float(time[0]), float(time[-1])
    release = analysis.released
    begin = first if release is None else release
    result = analysis.ends[end]
    events = result.events
    settled = result.gap.settled_from if result.gap is not None else None
    spans = []
    if len(events) > 1:
        middle = events[min(4, len(events) - 1)].start
        first_name = "up to the second contact" if release is None else "fall, first contact, rebound"
        spans.append((first_name, begin, events[1].start))
        if middle > events[1].start:
            spans.append(("following contacts", events[1].start, middle))
        if settled is not None and settled > middle:
            spans.append(("last contacts", max(middle, settled - 0.08), settled))
    elif settled is None or settled > begin:
        whole = "from the first sample on" if release is None else "from the release on"
        spans.append((whole, begin, min(begin + 0.1, last)))
        spans += _whirl_span(analysis, end)
    if settled is not None:
        swing = analysis.swing.frequencies[0].value if analysis.swing is not None else None
        length = 3 / (swing or 30.0)
        spans.append(("settled", settled, min(settled + length, last)))
        end_of_turning = _standstill(analysis, last)
        for name, share in (("run-down", 0.3), ("late run-down", 0.8)):
            at = settled + share * (end_of_turning - settled)
            long = min(max(length, _turns(analysis, at)), 2.0)
            if at > spans[-1][2] and at + long <= last:
                spans.append((name, at, at + long))
    return spans[:_PANELS]


def _whirl_span(analysis: Analysis, end: str) -> list[tuple[str, float, float]]:
    """Return a few turns from the middle of the longest whirl of an end; an empty list without whirl."""
    longest = analysis.whirl[end].worst if end in analysis.whirl else None
    if longest is None:
        return []
    few = min(_WHIRL_TURNS / abs(longest.turns), 1.0) * longest.duration_s
    begin = longest.start_s + 0.5 * (longest.duration_s - few)
    return [("backward whirl" if longest.turns < 0 else "whirl", begin, begin + few)]


def _turns(analysis: Analysis, at: float) -> float:
    """Return the time of three revolutions, s; zero if the speed is not known."""
    if not analysis.has_speed:
        return 0.0
    near = slice(*np.searchsorted(analysis.speed_time, [at - 0.1, at + 0.1]))
    speed = float(np.mean(analysis.speed_hz[near])) if near.stop > near.start else 0.0
    return 3 / speed if speed > 0 else 0.0


def _standstill(analysis: Analysis, last: float) -> float:
    still = analysis.rundown.standstill_time.value if analysis.rundown is not None else None
    return last if still is None else min(still, last)


def _orbit(ax: Axes, analysis: Analysis, end: str, name: str, start: float, stop: float) -> None:
    planes = analysis.planes
    orbit_axes(ax)
    if planes is None:
        say(ax, "no displacement")
        return
    time = planes.time.to_numpy()
    inside = slice(*np.searchsorted(time, [start, stop]))
    t, xy = time[inside], planes.displacement.sel(end=end).to_numpy()[:, inside] * UM
    if np.isfinite(xy).all(axis=0).sum() < 2:
        say(ax, "no samples have values here")
        return
    ax.plot(*xy, color=BLUE, linewidth=0.6, label="orbit", rasterized=len(t) > _DENSE)
    ax.plot(*xy[:, 0], "o", color=GREEN, markersize=4, label="begin")
    ax.plot(*xy[:, -1], "s", color=VERMILION, markersize=3.5, label="end")
    magnified = frame_orbit(ax, analysis, end, xy)
    pulses = _pulses(ax, analysis, t, xy)
    above = f"{clipped(end, TITLE_LETTERS)}, {name}{'' if pulses else ', no pulses'}"
    ax.set_title(f"{above}\n{time_span(start, stop)}{', magnified' if magnified else ''}", fontsize=7, loc="center")


def time_span(start: float, stop: float) -> str:
    digits = 4 if start < 1.0 else 2
    return f"{start:.{digits}f} to {stop:.{digits}f} s"


def _pulses(ax: Axes, analysis: Analysis, t: np.ndarray, xy: np.ndarray) -> bool:
    """Draw a dot at each keyphasor pulse, where the shaft angle is that of its mark; return False if pulses are missing."""
    if analysis.angle is None or analysis.planes is None:
        return True
    mark = analysis.machine.keyphasor.angle if analysis.machine.keyphasor is not None else 0.0
    first = int(np.searchsorted(analysis.planes.time.to_numpy(), t[0]))
    turns = analysis.machine.sense * (analysis.angle[first : first + len(t)] - mark) / (2 * np.pi)
    # turns at a pulse are whole up to rounding, which must not decide on which side of the pulse a sample lies
    whole = np.floor(turns + 1e-6)
    passed = np.flatnonzero(np.diff(whole) > 0)
    if passed.size:
        share = (whole[passed + 1] - turns[passed]) / (turns[passed + 1] - turns[passed])
        dots = xy[:, passed] + share * (xy[:, passed + 1] - xy[:, passed])
        keyphasor_dots(ax, dots)
    return not np.isnan(turns).all()
