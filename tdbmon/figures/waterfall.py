"""Waterfall: spectra of each end and direction against time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tdbmon.figures.spectral_map import draw_maps, edges, spectra_of
from tdbmon.figures.style import styled

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis


@styled
def waterfall(analysis: Analysis) -> Figure:
    """Draw the waterfall with order lines and lines of constant frequency.

    Raises
    ------
    InputError
        As `spectra_of`.
    """
    spectra = spectra_of(analysis)
    time = spectra.time.to_numpy()
    orders, notes = None, [f"{100 * spectra.attrs['overlap']:.0f} % overlap"]
    if analysis.has_speed:
        orders = np.interp(time, analysis.speed_time, analysis.speed_hz), time
    else:
        notes.append("no speed: no orders")
    return draw_maps(analysis, spectra, 112, ("time [s]", *edges(time, spectra.attrs["step_s"])), orders, notes)
