"""Waterfall: spectra of each end and direction against time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.figures.spectral_map import colour_limits, constants_of, decibel, draw_lines, draw_map, edges, top_frequency
from tdbmon.figures.style import AXIS_WORD, Margins, colour_bar, new_figure, said, styled, subplots

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis


@styled
def waterfall(analysis: Analysis) -> Figure:
    """Draw the waterfall with order lines and lines of constant frequency.

    Raises
    ------
    InputError
        If the record holds no displacement.
    """
    spectra = analysis.waterfall
    if spectra is None or analysis.planes is None:
        raise InputError("the record holds no displacement whose spectra could be drawn")
    ends = analysis.seen_ends
    frequency, time = spectra.frequency.to_numpy(), spectra.time.to_numpy()
    top_hz = top_frequency(analysis, float(frequency[-1]))
    keep = frequency <= top_hz
    window = f"{spectra.attrs['window'].capitalize()} window of {spectra.attrs['window_s']:.3g} s"
    orders, notes = None, [window, f"{100 * spectra.attrs['overlap']:.0f} % overlap"]
    if analysis.has_speed:
        orders = np.interp(time, analysis.speed_time, analysis.speed_hz), time
    else:
        notes.append("no speed: no orders")
    figure = new_figure(112, said(analysis, *notes))
    axes = subplots(figure, 2, len(ends), Margins(13, 21, 11, 10, across=6, down=8), sharex=True, sharey=True)
    limits = colour_limits(decibel(spectra.amplitude.sel(end=ends).to_numpy()))
    extent = (*edges(frequency[keep], frequency[1]), *edges(time, spectra.attrs["step_s"]))
    for column, end in enumerate(ends):
        for row, axis in enumerate(("y", "x")):
            ax = axes[row, column]
            db = decibel(spectra.amplitude.sel(end=end, axis=axis).to_numpy()[:, keep])
            image = draw_map(ax, db, extent, limits)
            ax.set_title(f"{end}, {AXIS_WORD[axis]}")
            ax.set_xlim(0.0, extent[1])
            ax.set_ylim(extent[2], extent[3])
            draw_lines(ax, orders, constants_of(analysis, end, top_hz), top_hz)
            ax.grid(False)
            if row == 1:
                ax.set_xlabel("frequency [Hz]")
            if column == 0:
                ax.set_ylabel("time [s]")
    colour_bar(figure, image, f"amplitude [dB re 1 µm {spectra.attrs['scale']}]")
    return figure
