"""The settled orbit unfiltered, filtered to 1X, and averaged over revolutions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.analysis.orbit import OrbitKind, orbit
from tdbmon.estimate import Z95
from tdbmon.figures.orbit_axes import frame_orbit, keyphasor_dots, orbit_axes
from tdbmon.figures.orbit_sequence import time_span
from tdbmon.figures.style import (
    BLUE,
    GREY,
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

_MOST, _FEWEST = 16, 8  # revolutions
_SEEN = 3.0  # standard deviations above which 1X is significant
_DENSE = 500  # samples, above which the line is rasterised
_PANEL_MM, _DOWN_MM = 38.0, 19.0


@dataclass(frozen=True)
class Stretch:
    """A stretch of whole revolutions of the settled shaft: `revolutions` of them, from the first pulse after `start` (s)."""

    planes: xr.Dataset
    angle: np.ndarray
    ends: tuple[str, ...]
    start: float
    revolutions: int


@styled
def filtered_orbit(analysis: Analysis) -> Figure:
    """Draw the first whole revolutions after settling, one row per end: unfiltered, 1X filtered, and averaged.

    All ends show the same stretch (`settled_stretch`); small orbits are magnified and marked so.

    Raises
    ------
    InputError
        If there is no such stretch.
    """
    stretch = settled_stretch(analysis)
    ends, revolutions = stretch.ends, stretch.revolutions
    mark = analysis.machine.keyphasor.angle if analysis.machine.keyphasor is not None else 0.0
    kinds: dict[OrbitKind, str] = {
        "raw": "not filtered",
        "1X": "1X filtered",
        "averaged": f"averaged over {revolutions} revolutions",
    }
    height = 30 + len(ends) * _PANEL_MM + (len(ends) - 1) * _DOWN_MM
    figure = new_figure(height, said(analysis, " / ".join(kinds.values())))
    axes = subplots(figure, len(ends), 3, Margins(15, 5, 14, 16, across=18, down=_DOWN_MM))
    for column, (kind, words) in enumerate(kinds.items()):
        cut = orbit(stretch.planes, stretch.angle, stretch.start, revolutions, kind, analysis.machine.sense, mark)
        for ax, end in zip(axes[:, column], ends, strict=True):
            _panel(ax, analysis, cut.sel(end=end), words)
    legend_below(figure)
    return figure


def settled_stretch(analysis: Analysis) -> Stretch:
    """Return up to 16 revolutions after all ends with a clearance circle have settled.

    Raises
    ------
    InputError
        If the shaft angle is not known, no end settles, or the angle is known for fewer than 8 consecutive whole revolutions.
    """
    planes, angle = analysis.planes, analysis.angle
    if planes is None or angle is None:
        raise InputError("an orbit cannot be filtered to 1X without displacement and the pulses of a keyphasor")
    settled = {end: gap.settled_from for end in analysis.seen_ends if (gap := analysis.ends[end].gap) is not None}
    if not settled:
        raise InputError("no clearance circle is known at any end")
    start = max(settled.values())
    after = angle[planes.time.to_numpy() >= start]
    unknown = np.flatnonzero(np.isnan(after))
    known = after[: unknown[0]] if unknown.size else after
    turns = abs(known[-1] - known[0]) / (2 * np.pi) if known.size else 0.0
    revolutions = min(int(turns) - 1, _MOST)  # the first begins at the next pulse
    if revolutions < _FEWEST:
        raise InputError(
            f"the shaft angle is known for {turns:.1f} consecutive revolutions after settling at {start:.4g} s; filtered"
            f" orbits need {_FEWEST + 1}"
        )
    return Stretch(planes, angle, tuple(settled), start, revolutions)


def telling_stretch(analysis: Analysis) -> Stretch:
    """Return the settled stretch, provided that 1X is significant in it.

    Raises
    ------
    InputError
        As `settled_stretch`; or if 1X at no end exceeds the remainder of the swing, which is not locked to the shaft and does
        not average out in so few revolutions.
    """
    stretch = settled_stretch(analysis)
    cuts = [
        orbit(stretch.planes, stretch.angle, stretch.start, stretch.revolutions, kind, analysis.machine.sense)
        for kind in ("1X", "averaged")
    ]
    first, mean = (cut.sel(end=list(stretch.ends)) for cut in cuts)
    size = (first.displacement.max("sample") - first.displacement.min("sample")) / 2
    sigma = np.sqrt((mean.deviation**2).mean("sample") * 2 / stretch.revolutions)
    if bool((size > _SEEN * sigma).any()) or not bool(np.isfinite(size).any()):
        return stretch
    raise InputError(
        f"over the {stretch.revolutions} revolutions after settling 1X is {float(size.max()) * UM:.2g} µm 0-pk at most, and the"
        f" swing, which is not locked to the shaft, adds an error of ±{Z95 * float(sigma.max()) * UM:.3g} µm"
    )


def _panel(ax: Axes, analysis: Analysis, cut: xr.Dataset, words: str) -> None:
    end = str(cut.end.item())
    orbit_axes(ax)
    title = f"{end}, {words}\n{cut.attrs['speed_hz']:.1f} Hz, {time_span(cut.attrs['start_s'], cut.attrs['end_s'])}"
    ax.set_title(title, fontsize=7, loc="center")
    xy = cut.displacement.transpose("axis", "sample").to_numpy() * UM
    if not np.isfinite(xy).all():
        say(ax, "samples are missing\nin this stretch")
        return
    pulses = cut.keyphasor.to_numpy()
    if cut.attrs["kind"] == "1X":  # all revolutions are equal; the average need not close and is left open
        pulses = pulses[:1]
        xy = np.column_stack([xy[:, : cut.keyphasor.to_numpy()[1]], xy[:, 0]])
    ax.plot(*xy, color=BLUE, linewidth=0.6, label="orbit", rasterized=xy.shape[1] > _DENSE)
    keyphasor_dots(ax, xy[:, pulses])
    if frame_orbit(ax, analysis, end, xy):
        ax.annotate("magnified", (0.03, 0.93), xycoords="axes fraction", fontsize=6, color=GREY)
    if "deviation" in cut:
        x, y = np.sqrt((cut.deviation**2).mean("sample")).sel(axis=["x", "y"]).to_numpy() * UM
        ax.annotate(
            f"one revolution deviates by\n±{x:.3g} (x), ±{y:.3g} (y) µm",
            (0.03, 0.03),
            xycoords="axes fraction",
            fontsize=6,
            color=GREY,
        )
