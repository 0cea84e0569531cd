"""Critical speed map: natural frequencies against support stiffness, beside the measured lines of constant frequency."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tdbmon.figures.labels import Labels, Place
from tdbmon.figures.spectral_map import colour_limits, decibel, draw_map, edges
from tdbmon.figures.style import (
    BLACK,
    BLUE,
    GREY,
    PURPLE,
    SKY,
    VERMILION,
    Margins,
    colour_bar,
    legend_below,
    new_figure,
    power_ticks,
    say,
    styled,
    subplots,
)

if TYPE_CHECKING:
    from tdbmon.analysis.lines import Line
    from tdbmon.analysis.resting_modes import RestingModes
    from tdbmon.analysis.result import Analysis
    from tdbmon.identify.natural_frequencies import NaturalFrequencies

_BEYOND = 1.1  # top of the frequency axis, times the machine's highest natural frequency
# candidate label offsets about a line, at the right edge and at the left
_ABOUT = [((x, y), ha, va) for x, ha in ((-2.0, "right"), (2.0, "left")) for y, va in ((1.5, "bottom"), (-1.5, "top"))]
COLOUR = {"sideways": BLUE, "up and down": VERMILION}


@styled
def critical_speed_map(found: NaturalFrequencies, analysis: Analysis, lines: Sequence[Line]) -> Figure:
    """Draw the map (left) and the record's spectra against time (right) with a common frequency axis.

    `lines` of constant frequency are drawn through both.
    """
    first, second = found.support
    note = f"Rotor at rest on its touchdown bearings · both supports varied, {second} in the fitted ratio to {first}"
    figure = new_figure(118, note)
    left, right = subplots(figure, 1, 2, Margins(15, 22, 20, 22, across=4), sharey=True)[0]
    top = _BEYOND * max(mode.frequency.value or 0.0 for mode in found.modes)
    _map(left, found)
    _spectra(figure, right, analysis, top)
    left.set_ylim(0, top)
    shown = [(line, hz) for line in lines if (hz := float(line.frequency.value or 0.0)) <= top]
    for _, hz in shown:
        left.axhline(hz, color=PURPLE, linestyle=(0, (4, 2)), linewidth=0.8, label="line in the record")
        right.axhline(hz, color="white", linestyle=(0, (1, 3)), linewidth=0.6)
    labels, edges_of = Labels(left, {"color": BLACK, "fontsize": 6}), left.get_xlim()
    for line, hz in shown:
        places = [Place(edges_of[ha == "right"], hz, offset, ha, va) for offset, ha, va in _ABOUT]
        labels.write(line.name if line.name.endswith(" Hz") else f"{line.name}, {hz:.1f} Hz", places)
    left.set_ylabel("frequency [Hz]")
    legend_below(figure, 4)
    return figure


def by_direction(modes: RestingModes, k: int) -> dict[str, np.ndarray]:
    """Return the k-th natural frequency, Hz, split into its sideways and its up-and-down parts; NaN elsewhere."""
    sideways = modes.sideways[:, k] > 0.5
    frequency = modes.frequencies[:, k]
    return {
        "sideways": np.where(sideways, frequency, np.nan),
        "up and down": np.where(sideways, np.nan, frequency),
    }


def _map(ax: Axes, found: NaturalFrequencies) -> None:
    first, second = found.support.values()
    base = float(first.value or 1.0)
    ratio = float(second.value or 1.0) / base
    x = found.factors * base
    for k in range(found.still.frequencies.shape[1]):
        ax.semilogx(x, found.still.frequencies[:, k], color=GREY, linewidth=2.2, alpha=0.45, label="at standstill")
        for direction, curve in by_direction(found.turning, k).items():
            label = f"{direction}, at {found.speed:.0f} Hz"
            ax.semilogx(x, curve, color=COLOUR[direction], linewidth=1.0, label=label)
    label = "stiffness of the machine file"
    if first.low is not None and first.high is not None:
        ax.axvspan(first.low, first.high, color=SKY, alpha=0.8, linewidth=0)
        label = "fitted stiffness (95 % in blue)"
    ax.axvline(base, color=BLACK, linewidth=0.8, label=label)
    for mode in found.modes:
        ax.plot(base, mode.frequency.value or 0.0, "o", color=COLOUR[mode.direction], markersize=3.5, zorder=5)
    ax.set_xlim(x[0], x[-1])
    names = list(found.support)
    ax.set_xlabel(f"support stiffness {names[0]} [N/m]")
    above = ax.secondary_xaxis("top", functions=(partial(np.multiply, ratio), partial(np.multiply, 1 / ratio)))
    for axis in (ax.xaxis, above.xaxis):
        power_ticks(axis)
    above.set_xlabel(f"support stiffness {names[1]} [N/m]")


def _spectra(figure: Figure, ax: Axes, analysis: Analysis, top: float) -> None:
    ax.set_xlabel("time [s]")
    ax.set_title("as measured (greatest of all)")
    spectra = analysis.waterfall
    if spectra is None:
        say(ax, "no displacement")
        return
    frequency, time = spectra.frequency.to_numpy(), spectra.time.to_numpy()
    keep = frequency <= top
    db = decibel(spectra.amplitude.max(("end", "axis")).transpose("frequency", "time").to_numpy())
    extent = (*edges(time, spectra.attrs["step_s"]), *edges(frequency[keep], frequency[1]))
    image = draw_map(ax, db[keep], extent, colour_limits(db))
    ax.set_aspect("auto")
    ax.grid(False)
    if analysis.has_speed:
        speed = np.interp(time, analysis.speed_time, analysis.speed_hz)
        for order in (1.0, 2.0):
            ax.plot(time, order * speed, color="white", linestyle=(0, (4, 2)), linewidth=0.6)
    ax.set_xlim(extent[0], extent[1])
    colour_bar(figure, image, f"amplitude [dB re 1 µm {spectra.attrs['scale']}]")
