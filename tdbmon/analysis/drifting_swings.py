"""Swings in the clearance whose frequency drifts too much for a spectral line, as it depends on the amplitudes of both swings.

A line stays in its cell of the spectra against time (see `lines`).  A strong swing need not: after a drop the frequency of the
conical one may rise by a tenth while it decays.  Predicted swings missing among the lines are tracked in their frequency bands
from window to window: detections by the same rule (`cfar`) in the horizontal displacement, the direction of a swing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tdbmon.analysis import cfar
from tdbmon.analysis.line_names import Band
from tdbmon.analysis.lines import Line
from tdbmon.analysis.ridge import Spectra, peak_place
from tdbmon.estimate import Estimate

_NEAR = 3.0  # cells: a peak so near to an order of the speed, or to a line, is not attributed to a swing
_STEP, _GAP = 2, 3  # greatest move from window to window, cells; windows without a detection that end a track
_ORDERS = (1.0, 2.0)  # orders that may cross a swing's band at similar amplitude
_STRONG = 0.05  # of the amplitude of the strongest peak: a weaker one may be mains or another undetected line
_METHOD = "short-time spectra, peak interpolated between frequency bins"
_MOVING = "no interval: the frequency drifts within a window"
_AMPLITUDE = (
    "greatest over the windows, horizontal, at the end with the larger one; too small where it drifts within a window"
)


@dataclass(frozen=True)
class DriftingSwing:
    """A swing whose frequency drifts.

    Attributes
    ----------
    name : str
        "swing 1" (the lower one) or "swing 2".
    end : str
        End with the greater amplitude.
    lowest, highest : Estimate
        Range of its frequency, Hz.
    amplitude : Estimate
        Along the horizontal, 0-pk, m.
    first_s, last_s : float
        Middle of the first and of the last window in which it is detected, s.
    """

    name: str
    end: str
    lowest: Estimate
    highest: Estimate
    amplitude: Estimate
    first_s: float
    last_s: float


def lacking_swings(expected: Sequence[Band], lines: Sequence[Line]) -> list[Band]:
    """Return the bands of the swings that are missing among the lines."""
    told = {line.name for line in lines}
    return [band for band in expected if band.swing and band.name not in told]


def drifting_swings(
    spectra: Spectra, ends: Sequence[str], bands: Sequence[Band], lines: Sequence[Line]
) -> tuple[DriftingSwing, ...]:
    """Find the drifting swings in some frequency bands, each at the end where it is stronger.

    Parameters
    ----------
    spectra : Spectra
        Against time.
    ends : sequence of str
        Names along its first axis.
    bands : sequence of Band
        From `lacking_swings`.
    lines : sequence of Line
        Detected lines; a peak near one of constant frequency is not attributed to a swing.
    """
    steady = [line.frequency.value for line in lines if line.kind != "order" and line.frequency.value is not None]
    rate = cfar.cell_rate(spectra.coefficients.size)
    least = _STRONG**2 * float(np.nanmax(np.abs(spectra.coefficients[..., cfar.FIRST :]) ** 2, initial=0.0))
    best: dict[str, tuple[float, DriftingSwing]] = {}
    for e, end in enumerate(spectra.coefficients):
        power = np.nan_to_num(np.abs(end[0]) ** 2)
        found, floor = cfar.detect(power, rate)
        found &= _free(spectra, steady) & (power > least)
        for band in bands:
            swing = _followed(spectra, power, found, floor, band, ends[e])
            if swing is not None and (swing.amplitude.value or 0.0) > best.get(band.name, (0.0, swing))[0]:
                best[band.name] = (swing.amplitude.value or 0.0, swing)
    return tuple(best[band.name][1] for band in bands if band.name in best)


def _free(spectra: Spectra, steady: Sequence[float]) -> np.ndarray:
    """Return the mask (window, cell) of cells that are neither near an order of the speed nor near a line."""
    cells = np.arange(spectra.coefficients.shape[-1]) * spectra.resolution
    free = np.ones(spectra.coefficients.shape[2:], dtype=bool)
    for place in steady:
        free &= np.abs(cells - place) > _NEAR * spectra.resolution
    with np.errstate(invalid="ignore"):
        for order in _ORDERS:
            free &= ~(np.abs(cells - order * spectra.speed[:, None]) <= _NEAR * spectra.resolution)
    return free


def _followed(
    spectra: Spectra,
    power: np.ndarray,
    found: np.ndarray,
    floor: np.ndarray,
    band: Band,
    end: str,
) -> DriftingSwing | None:
    """Track the strongest peak of a band forward and backward in time; None if it is not detected in 4 of 8 windows."""
    name, low, high, _ = band
    cells = np.arange(power.shape[1]) * spectra.resolution
    here = np.where(found & (cells >= low) & (cells <= high), power, 0.0)
    if not here.any():
        return None
    start, first = (int(i) for i in np.unravel_index(here.argmax(), here.shape))
    course = {start: first}
    for step in (1, -1):
        last, cell, at = start, first, start + step
        while 0 <= at < len(here) and abs(at - last) <= _GAP:
            left = max(cell - _STEP, 0)
            near = here[at, left : cell + _STEP + 1]
            if near.any():
                cell = left + int(near.argmax())
                course[at], last = cell, at
            at += step
    window = np.array(sorted(course))
    shown = np.bincount(window, minlength=len(here))
    if len(shown) < cfar.WINDOWS or np.convolve(shown, np.ones(cfar.WINDOWS), "valid").max() < cfar.HITS:
        return None
    place, _, height = peak_place(power, floor, window, np.array([course[int(w)] for w in window]))
    peak = int(height.argmax())
    noise = float(np.sqrt(floor[window[peak], course[int(window[peak])]] / 2))
    lowest, highest = (
        Estimate(float(hz) * spectra.resolution, unit="Hz", method=_METHOD, why=_MOVING)
        for hz in (place.min(), place.max())
    )
    amplitude = Estimate.from_sigma(float(np.sqrt(height[peak])), noise, "um", _AMPLITUDE, "0-pk", least=0.0)
    begin, stop = (float(spectra.time[i]) for i in (window[0], window[-1]))
    return DriftingSwing(name, end, lowest, highest, amplitude, begin, stop)
