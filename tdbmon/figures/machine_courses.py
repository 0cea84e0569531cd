"""The main quantities of a machine over all its drops, with a colour for each speed class."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.drop_names import drop_names, drops_label, end_columns
from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Margins,
    interval_bar,
    legend_below,
    legend_room,
    new_figure,
    styled,
    subplots,
)
from tdbmon.figures.trends import axis_name, scale_of
from tdbmon.history.feature import KINDS, Key
from tdbmon.history.speed_class import stood

if TYPE_CHECKING:
    from tdbmon.history.machine_history import Course, MachineHistory

_SHOWN = 8
_NAMED = 10  # most drops labelled along an axis
_MOST = 16  # most panels on a page
_FIRST = ("gap_um", "fall_time_ms", "rebound_um", "v_rms", "stress_max_mpa", "stiffness_n_per_m", "decay_time_s")
_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
_MARKERS = "osD^vPX*"  # one more than colours, so that styles differ when colours repeat
_COLUMNS = 5  # of the legend


@styled
def machine_courses(history: MachineHistory) -> Figure:
    """Draw the quantities flagged in any drop, and the usual ones, over all drops of a machine."""
    flagged = history.flagged
    shown = shown_courses(history)
    rows = max(1, math.ceil(len(shown) / 2))
    names = _class_names(history)
    more = legend_room(len(names) + 2, _COLUMNS, 1)
    figure = new_figure(
        32 + more + 46 * rows, "All drops in their order · bars: 95 % interval of each drop's own estimate"
    )
    axes = subplots(figure, rows, 2, Margins(19, 3, 13, 22 + more, across=21, down=17))
    place = {entry.id: i for i, entry in enumerate(history.entries, start=1)}
    overhauls = [place[b.id] for a, b in pairwise(history.entries) if a.assembly != b.assembly]
    speed_class = dict(zip((e.id for e in history.entries), history.classes, strict=True))
    for ax, course in zip(axes.flat, shown, strict=False):
        factor = scale_of(KINDS[course.name].unit)[0]
        for number, name in names.items():
            own = [(place[e.id], s) for e, s in course.values if speed_class[e.id] == number]
            if not own:
                continue
            colour, marker = _COLOURS[number % len(_COLOURS)], _MARKERS[number % len(_MARKERS)]
            ax.plot(
                [x for x, _ in own], [(s.value or 0) * factor for _, s in own], marker, color=colour, markersize=3.5,
                label=name, zorder=3,
            )  # fmt: skip
            for x, s in own:
                interval_bar(ax, x, s, factor, color=colour, linewidth=0.8, alpha=0.5)
        off = [(place[e.id], s) for e, s in course.values if e.id in flagged.get(course.key, ())]
        if off:
            ax.plot(
                [x for x, _ in off], [(s.value or 0) * factor for _, s in off], "o", color=VERMILION, markersize=8,
                markerfacecolor="none", label="changed against the earlier drops", zorder=4,
            )  # fmt: skip
        if course.step is not None:
            ax.axvline(place[course.step.id] - 0.5, color=GREY, linewidth=0.8, linestyle="--", label="step")
        for number in overhauls:
            ax.axvline(number - 0.5, color=GREY, linewidth=0.8, linestyle=":")
        ax.set_title(course.title, fontsize=7)
        ax.set_ylabel(axis_name(KINDS[course.name]))
        drop_names(ax, history.entries, _NAMED)
    end_columns(axes, len(shown), drops_label(history.entries))
    legend_below(figure, _COLUMNS)
    return figure


def shown_courses(history: MachineHistory) -> list[Course]:
    """Return the courses to draw: quantities flagged in any drop, then the usual ones."""
    flagged = history.flagged
    found = [c for c in history.courses if c.name in _FIRST or c.key in flagged]
    return sorted(found, key=lambda c: _rank(c, flagged))[: max(_SHOWN, len(flagged))][:_MOST]


def _class_names(history: MachineHistory) -> dict[int, str]:
    """Return the name of each speed class, by its median speed."""
    speeds: dict[int, list[float]] = {number: [] for number in sorted(set(history.classes))}
    for entry, number in zip(history.entries, history.classes, strict=True):
        speeds[number] += [] if entry.speed is None else [entry.speed]
    return {number: _class_name(float(np.median(own))) if own else "speed unknown" for number, own in speeds.items()}


def _class_name(speed: float) -> str:
    return "standstill" if stood(speed) else f"{speed:.4g} Hz"


def _rank(course: Course, flagged: dict[Key, tuple[str, ...]]) -> tuple[int, int]:
    """Return the sort key: quantities flagged most often first, then the usual ones in their order."""
    times = len(flagged.get(course.key, ()))
    return -times, _FIRST.index(course.name) if course.name in _FIRST else len(_FIRST)
