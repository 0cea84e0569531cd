"""Cascade: spectra of each end and direction against speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from tdbsim.errors import InputError

from tdbmon.figures.spectral_map import draw_maps, edges, spectra_of
from tdbmon.figures.style import styled

if TYPE_CHECKING:
    import xarray as xr

    from tdbmon.analysis.result import Analysis


@styled
def cascade(analysis: Analysis) -> Figure:
    """Draw spectra against speed: orders are rays, lines of constant frequency are vertical.

    Raises
    ------
    InputError
        As `slowing_spectra`.
    """
    from tdbmon.analysis.spectrum import cascade as against_speed

    of_time = slowing_spectra(analysis)
    # speed steps wide enough that the decelerating rotor skips none
    at = np.interp(of_time.time.to_numpy(), analysis.speed_time, analysis.speed_hz)
    widest = max(float(np.max(np.abs(np.diff(at)), initial=0.0)), float(at.max()) / 100)
    spectra = against_speed(of_time, analysis.speed_time, analysis.speed_hz, widest)
    step, found = spectra.attrs["speed_step_hz"], spectra.speed.to_numpy()
    # speed steps without a spectrum stay empty
    speed = found[0] + step * np.arange(round((found[-1] - found[0]) / step) + 1)
    spectra = spectra.reindex(speed=speed, method="nearest", tolerance=step / 4)
    levels = "speed [Hz]", *edges(speed, step)
    return draw_maps(analysis, spectra, 108, levels, (speed, speed), [f"power mean in steps of {step:.2g} Hz"])


def slowing_spectra(analysis: Analysis) -> xr.Dataset:
    """Return the spectra against time, provided that the speed changes by at least their frequency resolution.

    Raises
    ------
    InputError
        As `spectra_of`; or if there is no speed, the rotor stands still, or the speed changes by less than the noise bandwidth.
    """
    spectra = spectra_of(analysis)
    if not analysis.has_speed:
        raise InputError("the record holds no speed as axis of the spectra")
    high, low = float(np.nanmax(analysis.speed_hz)), float(np.nanmin(analysis.speed_hz))
    if not high > 0:
        raise InputError("the rotor stands still throughout the record")
    if high - low < spectra.attrs["noise_bandwidth_hz"]:
        raise InputError(
            f"the speed changes by only {high - low:.2g} Hz in the record, less than the resolution of"
            f" {spectra.attrs['noise_bandwidth_hz']:.2g} Hz of windows of {spectra.attrs['window_s']:.2g} s;"
            " the waterfall shows the same spectra"
        )
    return spectra
