"""A map of spectra (frequency across, time or speed up) with order lines and lines of constant frequency drawn in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import AxesImage

from tdbmon.figures.style import UM

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis

ORDERS = (0.5, 1.0, 2.0, 3.0, 4.0)
RANGE_DB = 100.0
FLOOR_M = 1e-12
LEAST_HZ = 200.0  # both swings and the first bending on touchdown bearings lie below
_INK: dict[str, Any] = {"color": "white", "linewidth": 0.6, "alpha": 0.9}


def decibel(amplitude: np.ndarray) -> np.ndarray:
    """Amplitude, m, in dB re 1 µm."""
    return np.asarray(20 * np.log10(np.maximum(amplitude, FLOOR_M) * UM))


def top_frequency(analysis: Analysis, highest: float) -> float:
    """Highest frequency worth drawing, Hz: four and a half orders of the first speed, and all named lines."""
    speed = float(np.nanmax(analysis.speed_hz)) if len(analysis.speed_hz) else highest / 4.5
    named = [line.frequency.value for line in analysis.lines if line.kind != "order" and line.frequency.value]
    return min(highest, max(LEAST_HZ, 4.5 * speed, 1.15 * max(named, default=0.0)))


def colour_limits(db: np.ndarray) -> tuple[float, float]:
    """Darkest and brightest dB of a map: above nearly all noise up to the loudest, at most `RANGE_DB` apart."""
    finite = db[np.isfinite(db)]
    if not finite.size:
        return -RANGE_DB, 0.0
    top, floor = float(finite.max()), float(np.median(finite))
    # noise has Rayleigh amplitudes: three in a hundred exceed their median by 7 dB
    return max(floor + 7, top - RANGE_DB), top


def draw_map(
    ax: Axes, db: np.ndarray, extent: tuple[float, float, float, float], limits: tuple[float, float]
) -> AxesImage:
    """Draw a map (rows, frequencies) in dB over its extent (frequency and row limits)."""
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


def draw_orders(ax: Axes, speed: np.ndarray, level: np.ndarray, top_hz: float) -> None:
    """Draw orders of the speed: `speed` in Hz at each `level` of the vertical axis."""
    for order in ORDERS:
        frequency = order * speed
        ax.plot(np.where(frequency <= top_hz, frequency, np.nan), level, linestyle=(0, (4, 2)), **_INK)
        low, high = float(level.min()), float(level.max())
        inside = np.flatnonzero((frequency < 0.95 * top_hz) & (level < high - 0.07 * (high - low)))
        if inside.size:
            at = inside[np.argmax(frequency[inside])]
            ax.annotate(f"{order:g}X", (frequency[at], level[at]), xytext=(2, 2), textcoords="offset points",
                        color="white", fontsize=6.5, clip_on=True)  # fmt: skip


def draw_constants(ax: Axes, analysis: Analysis, end: str, top_hz: float) -> None:
    """Draw lines of constant frequency; those that are no sums and multiples of others by name."""
    last, row = -np.inf, 0
    for line in sorted(analysis.lines, key=lambda item: item.frequency.value or 0.0):
        frequency = line.frequency.value
        if line.kind == "order" or frequency is None or frequency > top_hz or line.end not in (end, "both", ""):
            continue
        ax.axvline(frequency, linestyle=(0, (1, 3)), color="white", linewidth=0.5, alpha=0.7)
        if any(sign in line.name for sign in (" + ", " - ", " x ")):
            continue
        # neighbours too near to be read side by side stand one below the other
        row = (row + 1) % 3 if frequency - last < 0.05 * top_hz else 0
        last = frequency
        ax.annotate(
            line.name,
            (frequency, 0.98 - 0.3 * row),
            xycoords=("data", "axes fraction"),
            xytext=(1, 0),
            textcoords="offset points",
            rotation=90,
            va="top",
            color="white",
            fontsize=6,
            clip_on=True,
        )
