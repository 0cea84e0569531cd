"""Waterfalls of a whole coast-down, measured beside simulated, with a common colour scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.spectral_map import colour_limits, decibel, draw_lines, draw_map, edges, top_frequency
from tdbmon.figures.style import AXIS_WORD, Margins, colour_bar, new_figure, say, styled, subplots
from tdbmon.record.slow_roll import runout_words

if TYPE_CHECKING:
    from tdbmon.identify.coast_down import CoastDown


@styled
def coast_down_waterfalls(whole: CoastDown) -> Figure:
    """Draw y and x, each as the maximum of both ends, with order lines from each record's own speed."""
    runout = runout_words(whole.measured.checks)
    figure = new_figure(118, f"Greater of both ends at each frequency and time · not filtered, {runout}")
    axes = subplots(figure, 2, 2, Margins(12, 21, 11, 10, across=6, down=8), sharex=True, sharey=True)
    limits: tuple[float, float] | None = None
    image = None
    for column, (words, analysis) in enumerate((("measured", whole.measured), ("simulated", whole.simulated))):
        spectra = analysis.waterfall
        for row, axis in enumerate(("y", "x")):
            ax = axes[row, column]
            ax.set_title(f"{words}, {AXIS_WORD[axis]}")
            if row == 1:
                ax.set_xlabel("frequency [Hz]")
            if column == 0:
                ax.set_ylabel("time [s]")
            if spectra is None:
                say(ax, "no displacement")
                continue
            frequency, time = spectra.frequency.to_numpy(), spectra.time.to_numpy()
            top_hz = top_frequency(whole.measured, float(frequency[-1]))
            keep = frequency <= top_hz
            db = decibel(spectra.amplitude.sel(axis=axis).max("end").transpose("time", "frequency").to_numpy())
            limits = limits or colour_limits(db)
            extent = (*edges(frequency[keep], frequency[1]), *edges(time, spectra.attrs["step_s"]))
            image = draw_map(ax, db[:, keep], extent, limits)
            ax.set_xlim(0.0, extent[1])
            ax.set_ylim(extent[2], extent[3])
            if analysis.has_speed:
                speed = np.interp(time, analysis.speed_time, analysis.speed_hz)
                draw_lines(ax, (speed, time), (), top_hz)
            ax.grid(False)
    if image is not None and whole.measured.waterfall is not None:
        colour_bar(figure, image, f"amplitude [dB re 1 µm {whole.measured.waterfall.attrs['scale']}]")
    return figure
