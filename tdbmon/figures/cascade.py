"""Cascade: spectra of each end and direction against speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.figures.spectral_map import colour_limits, constants_of, decibel, draw_lines, draw_map, edges, top_frequency
from tdbmon.figures.style import AXIS_WORD, Margins, colour_bar, new_figure, said, styled, subplots

if TYPE_CHECKING:
    import xarray as xr

    from tdbmon.analysis.result import Analysis


@styled
def cascade(analysis: Analysis) -> Figure:
    """Draw spectra against speed: orders are rays, lines of constant frequency stand upright.

    Raises
    ------
    InputError
        As `slowing_spectra`.
    """
    from tdbmon.analysis.spectrum import cascade as against_speed

    of_time = slowing_spectra(analysis)
    # steps wide enough that the slowing rotor jumps over none
    at = np.interp(of_time.time.to_numpy(), analysis.speed_time, analysis.speed_hz)
    widest = max(float(np.max(np.abs(np.diff(at)), initial=0.0)), float(at.max()) / 100)
    spectra = against_speed(of_time, analysis.speed_time, analysis.speed_hz, widest)
    ends = analysis.seen_ends
    frequency, speed = spectra.frequency.to_numpy(), spectra.speed.to_numpy()
    top_hz = top_frequency(analysis, float(frequency[-1]))
    keep = frequency <= top_hz
    step = spectra.attrs["speed_step_hz"]
    # steps that the speed jumped over stay empty
    row_of = np.round((speed - speed[0]) / step).astype(int)
    rows = speed[0] + step * np.arange(row_of[-1] + 1)
    extent = (*edges(frequency[keep], frequency[1]), *edges(rows, step))
    window = f"{spectra.attrs['window'].capitalize()} window of {spectra.attrs['window_s']:.3g} s"
    figure = new_figure(108, said(analysis, window, f"power mean in steps of {step:.2g} Hz"))
    axes = subplots(figure, 2, len(ends), Margins(13, 21, 11, 10, across=6, down=8), sharex=True, sharey=True)
    limits = colour_limits(decibel(spectra.amplitude.sel(end=ends).to_numpy()))
    for column, end in enumerate(ends):
        for row, axis in enumerate(("y", "x")):
            ax = axes[row, column]
            db = np.full((len(rows), int(keep.sum())), np.nan)
            db[row_of] = decibel(
                spectra.amplitude.sel(end=end, axis=axis).transpose("speed", "frequency").to_numpy()[:, keep]
            )
            image = draw_map(ax, db, extent, limits)
            ax.set_title(f"{end}, {AXIS_WORD[axis]}")
            ax.set_xlim(0.0, extent[1])
            ax.set_ylim(extent[2], extent[3])
            draw_lines(ax, (rows, rows), constants_of(analysis, end, top_hz), top_hz)
            ax.grid(False)
            if row == 1:
                ax.set_xlabel("frequency [Hz]")
            if column == 0:
                ax.set_ylabel("speed [Hz]")
    colour_bar(figure, image, f"amplitude [dB re 1 µm {spectra.attrs['scale']}]")
    return figure


def slowing_spectra(analysis: Analysis) -> xr.Dataset:
    """Return the spectra against time of a rotor that slows by as much as they tell apart.

    Raises
    ------
    InputError
        If the record holds no displacement or no speed, the rotor stands still, or no order moves by the width of a line.
    """
    spectra = analysis.waterfall
    if spectra is None or analysis.planes is None:
        raise InputError("the record holds no displacement whose spectra could be drawn")
    if not analysis.has_speed:
        raise InputError("the record holds no speed to draw spectra against")
    high, low = float(np.nanmax(analysis.speed_hz)), float(np.nanmin(analysis.speed_hz))
    if not high > 0:
        raise InputError("the rotor stands still throughout the record; there is no speed to draw spectra against")
    if high - low < spectra.attrs["noise_bandwidth_hz"]:
        raise InputError(
            f"the speed changes by {high - low:.2g} Hz in the record, less than the {spectra.attrs['noise_bandwidth_hz']:.2g} Hz"
            f" that windows of {spectra.attrs['window_s']:.2g} s tell apart; the waterfall has the same spectra"
        )
    return spectra
