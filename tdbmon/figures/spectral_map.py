"""Maps of spectra (frequency horizontal, time or speed vertical) with order lines and lines of constant frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from tdbsim.errors import InputError

from tdbmon.figures.labels import Labels, Place
from tdbmon.figures.style import AXIS_WORD, UM, Margins, colour_bar, new_figure, said, subplots

if TYPE_CHECKING:
    import xarray as xr

    from tdbmon.analysis.lines import Line
    from tdbmon.analysis.result import Analysis

ORDERS = (0.5, 1.0, 2.0, 3.0, 4.0)
RANGE_DB = 100.0
FLOOR_M = 1e-12
LEAST_HZ = 100.0  # least frequency range: both swings on touchdown bearings lie below
_DARK = 0.25  # lowest share of the colour scale, which looks empty
_BRIGHT = 0.98  # share of the brighter content that must lie within the frequency range
_INK: dict[str, Any] = {"color": "white", "linewidth": 0.6, "alpha": 0.9}
_SHARES = (0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)  # of the height: candidate distances of a label from the top
# labels lie over the lines on a patch of the map's darkest colour
_NAME: dict[str, Any] = {
    "color": "white", "fontsize": 6.0, "zorder": 5,
    "bbox": {"facecolor": "#440154", "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
}  # fmt: skip


def spectra_of(analysis: Analysis) -> xr.Dataset:
    """Return the spectra against time.

    Raises
    ------
    InputError
        If the record has no displacement, or no complete stretch as long as a window.
    """
    if analysis.planes is None:
        raise InputError("the record holds no displacement")
    if analysis.waterfall is None:
        raise InputError("every stretch of the record as long as a window has missing samples")
    return analysis.waterfall


def draw_maps(
    analysis: Analysis,
    spectra: xr.Dataset,
    height: float,
    levels: tuple[str, float, float],
    orders: tuple[np.ndarray, np.ndarray] | None,
    notes: Sequence[str],
) -> Figure:
    """Draw spectra of each end (a column) and direction (a row) with order lines and lines of constant frequency.

    Parameters
    ----------
    analysis : Analysis
    spectra : Dataset
        ``amplitude(end, axis, level, frequency)``, m, with uniformly spaced levels.
    height : float
        Height of the figure, mm.
    levels : tuple
        Label of the vertical axis, and its lower and upper limit.
    orders : tuple of np.ndarray or None
        As in `draw_lines`.
    notes : sequence of str
        Further notes after the one on the window.
    """
    ends, (label, low, high) = analysis.seen_ends, levels
    frequency = spectra.frequency.to_numpy()
    top_hz = top_frequency(analysis, float(frequency[-1]))
    keep = frequency <= top_hz
    window = f"{spectra.attrs['window'].capitalize()} window of {spectra.attrs['window_s']:.3g} s"
    figure = new_figure(height, said(analysis, window, *notes))
    axes = subplots(figure, 2, len(ends), Margins(13, 21, 11, 10, across=6, down=8), sharex=True, sharey=True)
    limits = colour_limits(decibel(spectra.amplitude.sel(end=ends).to_numpy()))
    extent = (*edges(frequency[keep], frequency[1]), low, high)
    for column, end in enumerate(ends):
        for row, axis in enumerate(("y", "x")):
            ax = axes[row, column]
            amplitude = spectra.amplitude.sel(end=end, axis=axis).transpose(..., "frequency").to_numpy()
            image = draw_map(ax, decibel(amplitude[:, keep]), extent, limits)
            ax.set_title(f"{end}, {AXIS_WORD[axis]}")
            ax.set_xlim(0.0, extent[1])
            ax.set_ylim(low, high)
            draw_lines(ax, orders, constants_of(analysis, end, top_hz), top_hz)
            ax.grid(False)
            if row == 1:
                ax.set_xlabel("frequency [Hz]")
            if column == 0:
                ax.set_ylabel(label)
    colour_bar(figure, image, f"amplitude [dB re 1 µm {spectra.attrs['scale']}]")
    return figure


def decibel(amplitude: np.ndarray) -> np.ndarray:
    """Return an amplitude, m, in dB re 1 µm."""
    return np.asarray(20 * np.log10(np.maximum(amplitude, FLOOR_M) * UM))


def top_frequency(analysis: Analysis, highest: float) -> float:
    """Return the highest frequency to draw, Hz, which covers nearly all bright content of the waterfall, all lines and 1X."""
    speed = float(np.nanmax(analysis.speed_hz)) if analysis.has_speed else 0.0
    named = [line.frequency.value for line in analysis.lines if line.kind != "order" and line.frequency.value]
    return min(
        highest, max(LEAST_HZ, 1.2 * speed, 1.15 * max(named, default=0.0), 1.1 * _bright_up_to(analysis.waterfall))
    )


def _bright_up_to(spectra: xr.Dataset | None) -> float:
    """Return the frequency, Hz, below which 98 % of a waterfall's visibly bright content lies."""
    if spectra is None:
        return 0.0
    db = decibel(spectra.amplitude.transpose(..., "frequency").to_numpy())
    low, high = colour_limits(db)
    bright = np.nansum(np.maximum(db - low - _DARK * (high - low), 0.0), axis=tuple(range(db.ndim - 1)))
    within = int((np.cumsum(bright) <= _BRIGHT * bright.sum()).sum())
    return float(spectra.frequency[min(within, len(bright) - 1)])


def colour_limits(db: np.ndarray) -> tuple[float, float]:
    """Return the colour limits of a map, dB: from above nearly all noise to the maximum, at most `RANGE_DB` apart."""
    finite = db[np.isfinite(db)]
    if not finite.size:
        return -RANGE_DB, 0.0
    top, floor = float(finite.max()), float(np.median(finite))
    # noise amplitudes are Rayleigh distributed: 3 % exceed the median by 7 dB
    low = max(floor + 7, top - RANGE_DB)
    return low, max(top, low + 1)


def edges(middles: np.ndarray, step: float) -> tuple[float, float]:
    """Return lower and upper edge of a row of cells with these centres (n,), `step` apart."""
    return float(middles[0]) - step / 2, float(middles[-1]) + step / 2


def draw_map(
    ax: Axes, db: np.ndarray, extent: tuple[float, float, float, float], limits: tuple[float, float]
) -> AxesImage:
    """Draw a map (rows, frequencies) in dB with its extent (frequency and row limits)."""
    return ax.imshow(
        db,
        origin="lower",
        aspect="auto",
        extent=extent,
        cmap="viridis",
        vmin=limits[0],
        vmax=limits[1],
        interpolation="nearest",
    )


def draw_lines(
    ax: Axes, orders: tuple[np.ndarray, np.ndarray] | None, constants: Sequence[Line], top_hz: float
) -> None:
    """Draw and label orders and lines of constant frequency in a map whose limits are set.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    orders : tuple of np.ndarray or None
        Speed, Hz, at each level of the vertical axis, and the levels; None if the speed is unknown.
    constants : sequence of Line
        Lines of constant frequency; sums and multiples of others are not labelled.
    top_hz : float
        Highest frequency drawn.
    """
    for line in constants:
        ax.axvline(line.frequency.value or 0.0, linestyle=(0, (1, 3)), color="white", linewidth=0.5, alpha=0.7)
    curves = {}
    if orders is not None:
        speed, level = orders
        for order in ORDERS:
            curves[order] = np.where(order * speed <= top_hz, order * speed, np.nan), level
            ax.plot(*curves[order], linestyle=(0, (4, 2)), **_INK)
    labels = Labels(ax, _NAME)
    low, high = ax.get_ylim()
    for line in constants:
        if not line.combined:
            hz = line.frequency.value or 0.0
            # on the line: beside it the label would cover that of a neighbour, e.g. swing and mains 6 Hz apart
            places = [Place(hz, high - share * (high - low), (0.0, 0.0), ha="center", va="top") for share in _SHARES]
            labels.write(line.name, places, rotation=90)
    for order, (frequency, level) in curves.items():
        labels.write(f"{order:g}X", _along(frequency, level, low, high))


def constants_of(analysis: Analysis, end: str, top_hz: float) -> list[Line]:
    """Return the lines of constant frequency of an end up to a frequency, in ascending order."""
    found = [
        line
        for line in analysis.lines
        if line.kind != "order" and line.end in (end, "both", "") and (line.frequency.value or np.inf) <= top_hz
    ]
    return sorted(found, key=lambda line: line.frequency.value or 0.0)


def _along(frequency: np.ndarray, level: np.ndarray, low: float, high: float) -> list[Place]:
    """Return label places beside the curve of an order, from its highest frequency down, away from where all orders meet."""
    edge = 0.05 * (high - low)
    inside = np.flatnonzero(np.isfinite(frequency) & (level > low + edge) & (level < high - edge))
    inside = inside[frequency[inside] > 0.4 * np.max(frequency[inside], initial=0.0)]
    if not inside.size:
        return []
    inside = inside[np.argsort(-frequency[inside], kind="stable")]
    at = inside[np.unique(np.linspace(0, inside.size - 1, 12).astype(int))]
    sides = ((1.5, "left"), (-1.5, "right"))
    return [Place(float(frequency[k]), float(level[k]), (away, 0.0), side) for away, side in sides for k in at]
