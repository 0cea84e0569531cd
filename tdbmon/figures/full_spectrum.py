"""Full spectra: amplitude of forward (right) and backward (left) whirl against frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.figures.labels import Labels, Place
from tdbmon.figures.spectral_map import decibel, top_frequency
from tdbmon.figures.style import BLUE, GREY, VERMILION, Margins, new_figure, said, say, styled, subplots

if TYPE_CHECKING:
    import xarray as xr

    from tdbmon.analysis.result import Analysis

_LONGEST_S = 1.0
_LEAST_S = 0.04
_SHARES = (0.03, 0.14, 0.25)  # of the height: candidate distances of an order's label from the top
_NAME: dict[str, Any] = {
    "color": GREY, "fontsize": 6.0,
    "bbox": {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.4},
}  # fmt: skip


@styled
def full_spectrum(analysis: Analysis) -> Figure:
    """Draw the full spectrum of each end in stretches of the record's phases.

    Raises
    ------
    InputError
        If the record holds no displacement.
    """
    if analysis.planes is None:
        raise InputError("the record holds no displacement")
    ends, stretches = analysis.seen_ends, _stretches(analysis)
    known = () if analysis.has_speed else ("no speed: no orders",)
    note = said(analysis, "Hann window over each stretch", *known)
    figure = new_figure(20 + 34 * len(stretches), note)
    # space between columns for the tick labels 1000 and −1000
    margins = Margins(18, 4, 11, 10, across=8, down=8)
    axes = subplots(figure, len(stretches), len(ends), margins, sharex=True, sharey="row")
    for row, (name, start, stop) in enumerate(stretches):
        spectra = _spectra(analysis.planes, ends, start, stop, analysis.machine.sense)
        highest = max(float(spectra.forward.max()), float(spectra.backward.max()))
        if np.isfinite(highest):
            loudest = float(decibel(np.array(highest)))
            axes[row, 0].set_ylim(loudest - 90, loudest + 15)
        else:
            axes[row, 0].set_yticks([])
        for column, end in enumerate(ends):
            ax = axes[row, column]
            ax.set_title(f"{end}, {name}: {start:.2f} to {stop:.2f} s", fontsize=7)
            _panel(ax, analysis, spectra.sel(end=end), (start + stop) / 2)
            if row == len(stretches) - 1:
                ax.set_xlabel("frequency [Hz], forward positive")
            if column == 0:
                ax.set_ylabel("amplitude\n[dB re 1 µm 0-pk]")
    return figure


def _stretches(analysis: Analysis) -> list[tuple[str, float, float]]:
    """Return name, start and end (s) of the stretches to draw: at most one second at the beginning of each phase."""
    planes = analysis.planes
    if planes is None:
        return []
    found = []
    for phase in analysis.phases:
        # the fall is too short for a spectrum to resolve anything
        if phase.name in ("fall", "rest", "levitated again") or phase.end - phase.start < _LEAST_S:
            continue
        start = phase.start
        found.append((phase.name, start, min(phase.end, start + _LONGEST_S)))
        if phase.name == "run-down" and phase.end - start > 20 * _LONGEST_S:
            later = start + 0.15 * (phase.end - start)
            found.append(("later run-down", later, later + _LONGEST_S))
    time = planes.time.to_numpy()
    return found or [("whole record", float(time[0]), float(time[-1]))]


def _spectra(planes: xr.Dataset, ends: list[str], start: float, stop: float, sense: int) -> xr.Dataset:
    """Return the full spectra of one stretch, with a single window."""
    from tdbmon.analysis.spectrum import full_spectrum as transform

    part = planes.sel(end=ends, time=slice(start, stop))
    whole = part.sizes["time"] / planes.attrs["sampling_hz"]
    return transform(part, sense, window_s=whole).isel(time=0)


def _panel(ax: Axes, analysis: Analysis, spectra: xr.Dataset, at: float) -> None:
    frequency = spectra.frequency.to_numpy()
    top = top_frequency(analysis, float(frequency[-1]))
    keep = (frequency > 0) & (frequency <= top)
    ax.set_xlim(-top, top)
    forward, backward = (decibel(spectra[side].to_numpy()[keep]) for side in ("forward", "backward"))
    if not np.isfinite(forward).all():
        say(ax, "samples are missing in this stretch")
        return
    ax.plot(frequency[keep], forward, color=BLUE, linewidth=0.7)
    ax.plot(-frequency[keep], backward, color=VERMILION, linewidth=0.7)
    ax.axvline(0.0, color=GREY, linewidth=0.6)
    _orders(ax, analysis, at, float(frequency[1]), top)


def _orders(ax: Axes, analysis: Analysis, at: float, step: float, top: float) -> None:
    if not analysis.has_speed:
        return
    speed = float(np.interp(at, analysis.speed_time, analysis.speed_hz))
    if speed < step:  # orders closer than the resolution, or standstill
        return
    lines = [(order, side * order * speed) for order in (1, 2, 3) for side in (1, -1) if order * speed < 0.95 * top]
    for _, hz in lines:
        ax.axvline(hz, color=GREY, linewidth=0.5, linestyle=(0, (2, 2)), zorder=0)
    labels = Labels(ax, _NAME, must=False)  # at very low speed all orders coincide
    low, high = ax.get_ylim()
    for order, hz in lines:
        places = [Place(hz, high - share * (high - low), (1.0, 0.0), va="top") for share in _SHARES]
        labels.write(f"{order}X", places)
