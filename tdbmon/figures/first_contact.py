"""The first contact of each end: displacement along its direction, with the quantities derived from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    UM,
    VERMILION,
    Margins,
    centre_of,
    circled_ends,
    legend_below,
    new_figure,
    said,
    styled,
    subplots,
)
from tdbmon.quantity import whole_degrees

if TYPE_CHECKING:
    from tdbmon.analysis.first_contact import FirstContact
    from tdbmon.analysis.result import Analysis

_AFTER_S = 0.008  # shown after the lift-off


@styled
def first_contact(analysis: Analysis) -> Figure:
    """Draw displacement along the first contact's direction against time, one panel per end.

    Raises
    ------
    InputError
        If the first contact is known at no end.
    """
    ends = touched_ends(analysis)
    if not ends:
        raise InputError("the first contact is not known at any end")
    figure = new_figure(92, said(analysis))
    axes = subplots(figure, 1, len(ends), Margins(15, 3, 11, 23, across=17))[0]
    for ax, end in zip(axes, ends, strict=True):
        _panel(ax, analysis, end)
    legend_below(figure)
    return figure


def touched_ends(analysis: Analysis) -> list[str]:
    """Return the ends whose first contact is known."""
    return [
        end
        for end in circled_ends(analysis)
        if (first := analysis.ends[end].first_contact) is not None and first.touch.known
    ]


def _panel(ax: Axes, analysis: Analysis, end: str) -> None:
    result = analysis.ends[end]
    release = analysis.released
    ax.set_xlabel("time from the release [ms]" if release is not None else "time from the record's first sample [ms]")
    ax.set_ylabel("outward from the clearance centre [µm]")
    first = result.first_contact
    if first is None or result.gap is None or first.touch.value is None:
        return
    ax.set_title(f"{end}: along {whole_degrees(first.direction)} from +x")
    origin = 0.0 if release is None else release
    direction = np.array([np.cos(first.direction), np.sin(first.direction)])
    planes = analysis.planes
    if planes is None:
        return
    time = planes.time.to_numpy()
    stop = first.touch.value + (first.duration.value or 0.01) + _AFTER_S
    inside = slice(*np.searchsorted(time, [max(time[0], (release or first.touch.value - 0.008) - 0.002), stop]))
    t = time[inside]
    along = (planes.displacement.sel(end=end).to_numpy()[:, inside].T - centre_of(analysis, end)) @ direction
    ax.plot(
        (t - origin) * 1e3,
        along * UM,
        ".-",
        color=BLUE,
        markersize=1.8,
        linewidth=0.5,
        label="measured",
        rasterized=True,
    )
    rest = result.gap.size
    touching = rest - (result.travel.total - analysis.machine.bearing(end).balls.play)
    ax.axhline(rest * UM, color=BLACK, linewidth=0.8, linestyle=(0, (4, 2)), label="radius at rest")
    ax.axhline(touching * UM, color=GREY, linewidth=0.8, linestyle=(0, (1, 1)), label="touching radius")
    _fall(ax, analysis, end, direction, first.touch.value, origin)
    _half_sine(ax, first, t, along, rest, origin)
    _instants(ax, first, touching, rest, origin)
    ax.margins(x=0.02)


def _fall(ax: Axes, analysis: Analysis, end: str, direction: np.ndarray, touch: float, origin: float) -> None:
    """Draw the free fall from the state at the release, a parabola that is not fitted to the contact."""
    if analysis.release is None or end not in analysis.release.states:
        return
    state = analysis.release.states[end]
    start = analysis.release.time.value
    values = [state.x.value, state.y.value, state.vx.value, state.vy.value]
    if start is None or None in values:
        return
    x, y, vx, vy = (float(v) for v in values)  # type: ignore[arg-type]
    t = np.linspace(0.0, touch - start, 60)
    path = np.column_stack([x + vx * t, y + vy * t - 0.5 * analysis.machine.gravity * t**2]) - centre_of(analysis, end)
    label = "free fall from the state at the release"
    ax.plot((t + start - origin) * 1e3, path @ direction * UM, color=ORANGE, linewidth=1.2, label=label)


def _half_sine(ax: Axes, first: FirstContact, t: np.ndarray, along: np.ndarray, rest: float, origin: float) -> None:
    """Draw a half sine about the radius at rest between t1 and t2, as assumed by the single-mass stiffness."""
    t1, t2 = first.static_in.value, first.static_out.value
    if t1 is None or t2 is None or t2 <= t1:
        return
    inside = (t >= t1) & (t <= t2)
    if inside.sum() < 3:
        return
    shape = np.sin(np.pi * (t[inside] - t1) / (t2 - t1))
    amplitude = float(shape @ (along[inside] - rest) / (shape @ shape))
    fine = np.linspace(t1, t2, 60)
    curve = rest + amplitude * np.sin(np.pi * (fine - t1) / (t2 - t1))
    ax.plot((fine - origin) * 1e3, curve * UM, color=GREEN, linewidth=1.4, label="half sine of the single mass")


def _instants(ax: Axes, first: FirstContact, touching: float, rest: float, origin: float) -> None:
    """Mark touch and lift-off on the touching radius, t1 and t2 on the radius at rest, with their intervals."""
    touch, t1, t2 = first.touch, first.static_in, first.static_out
    marks = [(touch, touching, "o", VERMILION, "touch, lift-off")]
    if first.duration.value is not None and touch.value is not None:
        ax.plot(
            (touch.value + first.duration.value - origin) * 1e3,
            touching * UM,
            "o",
            color=VERMILION,
            markersize=4,
            zorder=5,
        )
    marks += [
        (t1, rest, "D", PURPLE, "t₁, t₂ (with 95 % intervals)"),
        (t2, rest, "D", PURPLE, "t₁, t₂ (with 95 % intervals)"),
    ]
    for instant, level, marker, colour, label in marks:
        if instant.value is None:
            continue
        errors = None
        if instant.low is not None and instant.high is not None:
            errors = [[(instant.value - instant.low) * 1e3], [(instant.high - instant.value) * 1e3]]
        ax.errorbar(
            (instant.value - origin) * 1e3,
            level * UM,
            xerr=errors,
            fmt=marker,
            color=colour,
            markersize=4,
            label=label,
            zorder=5,
        )
