"""Style shared by all figures: colours, fonts, sizes, and notes on what is drawn."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal, ParamSpec

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator

from tdbmon.quantity import raised
from tdbmon.record.slow_roll import runout_words

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable

    from tdbmon.analysis.result import Analysis
    from tdbmon.estimate import Estimate

P = ParamSpec("P")

WIDTH_MM = 170.0  # the text width of an A4 page
_LINE_MM = 3.0  # of a note above a figure
_LEGEND_MM = 4.0  # of a line of a legend
UM = 1e6
TITLE_LETTERS = 8  # of a name of a file in a title that says more
_NARROW = 6.5  # type of two lines where one has room
_LETTER_PT = 4.4  # mean width of a letter of figures' words

# Okabe and Ito, Color Universal Design (2008): told apart with every common colour vision
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7",
)  # fmt: skip
GREY, LIGHT = "#666666", "#DDDDDD"
_DROP_COLOURS = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, GREY, SKY, BLACK)
_DROP_LINES = ("-", "--", "-.")
MEASURED = "#BBBBBB"  # beneath what was simulated
AXIS_COLOUR = {"x": BLUE, "y": VERMILION}
AXIS_WORD = {"x": "x (right)", "y": "y (up)"}
PHASE_COLOUR = {
    "levitated": "#E8F1F8", "fall": "#FFF3D6", "contacts": "#FBE3D6", "fall and contacts": "#FBE3D6",
    "run-down": "#E6F4EE", "rest": "#F0F0F0", "levitated again": "#E8F1F8",
}  # fmt: skip

STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 7.5,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # placed, not found: looking for a free place takes a third of the drawing
    "axes.labelsize": 7.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": LIGHT,
    "legend.borderpad": 0.3,
    "legend.handlelength": 1.6,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.4,
    "grid.color": "#E4E4E4",
    "lines.linewidth": 0.9,
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": False,
    "text.parse_math": False,  # names come from files: a dollar sign is a dollar sign
    "axes.unicode_minus": True,
    "svg.fonttype": "none",
    "figure.dpi": 150,
    "image.composite_image": True,
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Let a figure function draw with the shared style."""

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with rc_context(STYLE):
            return draw(*args, **kwargs)

    return inside


def new_figure(height_mm: float, note: str = "") -> Figure:
    """Return an empty figure of the page's width; `note` says above it what was drawn."""
    figure = Figure(figsize=(WIDTH_MM / 25.4, height_mm / 25.4))
    if note:
        text = figure.text(0.008, 1 - 1.5 / height_mm, note, va="top", color=GREY, fontsize=7)
        share = text.get_window_extent().width / (0.984 * figure.bbox.width)
        if share > 1:
            lines = textwrap.wrap(note, int(len(note) / share) - 2)
            height_mm += _LINE_MM * (len(lines) - 1)
            figure.set_size_inches(WIDTH_MM / 25.4, height_mm / 25.4)
            text.set(text="\n".join(lines), y=1 - 1.5 / height_mm)
    return figure


@dataclass(frozen=True)
class Margins:
    """Room about and between the axes of a figure, mm.

    Fixed, since matplotlib's constrained layout takes as long as all the drawing.  A test verifies that nothing is clipped.
    """

    left: float
    right: float
    top: float
    bottom: float
    across: float = 0.0
    down: float = 0.0


def subplots(
    figure: Figure,
    rows: int,
    columns: int,
    margins: Margins,
    height_ratios: list[float] | None = None,
    sharex: bool = False,
    sharey: bool | Literal["row"] = False,
) -> np.ndarray:
    """Return axes (rows, columns) that fill the figure up to its margins."""
    width, height = (float(inches) * 25.4 for inches in figure.get_size_inches())
    above = margins.top + _LINE_MM * sum(text.get_text().count("\n") for text in figure.texts)  # of a note
    wide = (width - margins.left - margins.right - (columns - 1) * margins.across) / columns
    high = (height - above - margins.bottom - (rows - 1) * margins.down) / rows
    axes: np.ndarray = figure.subplots(
        rows,
        columns,
        squeeze=False,
        sharex=sharex,
        sharey=sharey,
        height_ratios=height_ratios,
        gridspec_kw={
            "left": margins.left / width,
            "right": 1 - margins.right / width,
            "top": 1 - above / height,
            "bottom": margins.bottom / height,
            "wspace": margins.across / wide,
            "hspace": margins.down / high,
        },
    )
    return axes


def drop_look(drop: int) -> tuple[str, str]:
    """Return colour and line style of one of several drops; colours are reused with other line styles."""
    lines, colour = divmod(drop, len(_DROP_COLOURS))
    return _DROP_COLOURS[colour], _DROP_LINES[lines % len(_DROP_LINES)]


def legend_room(entries: int, columns: int, lines: int) -> float:
    """Return the height that a legend needs below a figure beyond its first `lines`, mm."""
    return _LEGEND_MM * max(0, math.ceil(entries / columns) - lines)


def clipped(name: str, letters: int) -> str:
    """Return a name of a file with at most so many letters, of a longer one beginning and end."""
    if len(name) <= letters:
        return name
    tail = (letters - 1) // 2
    return f"{name[: letters - 1 - tail]}…{name[len(name) - tail :]}"


def name_axis(ax: Axes, words: str, name: str) -> None:
    """Label the vertical axis with words about a name of a file, as "{} force [kN]", no longer than it.

    Where it has no room the name has a line of its own, and where that has none its middle is left out.
    """
    label, room = ax.set_ylabel(words.format(name)), ax.bbox.height
    two = words if "\n" in words else words.replace("{} ", "{}\n")
    for letters in range(len(name), 1, -1):
        if label.get_window_extent().height <= room:
            break
        label.set(text=two.format(clipped(name, letters)), fontsize=_NARROW, linespacing=1.0)


def drop_axis(ax: Axes, drops: int, most: int) -> None:
    """Number the drops along x with `most` labels or one more, in whole numbers, a single drop too."""
    # one tick will do: where two are asked for and there is one drop, the locator takes fractions
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=most, min_n_ticks=1))
    ax.set_xlim(0.4, drops + 0.6)


def interval_bar(ax: Axes, at: float, estimate: Estimate, factor: float, shift: float = 0.0, **look: Any) -> None:
    """Draw the 95 % interval of an estimate upright, where it has one, in its own unit less a shift in that."""
    if estimate.low is not None and estimate.high is not None:
        ax.plot([at, at], [estimate.low * factor - shift, estimate.high * factor - shift], **look)


def not_told(ax: Axes, drop: int, marker: str, place: int = 0) -> None:
    """Mark at the lower edge the drops without a value; each series of the axes at its own `place`."""
    ax.plot(
        drop, 0.07 + 0.1 * place, marker, color=GREY, markersize=3.5, markerfacecolor="none", markeredgewidth=0.7,
        linestyle="none", transform=ax.get_xaxis_transform(), label="not told by the drop judged",
    )  # fmt: skip


def power_ticks(axis: Axis) -> None:
    """Tick a logarithmic axis at powers of ten, without mathtext: names come from files, and a dollar is a dollar."""
    axis.set_major_locator(LogLocator(10.0))
    axis.set_major_formatter(FuncFormatter(_power))
    name_between(axis)


def name_between(axis: Axis) -> None:
    """Name some ticks between the powers of ten of a logarithmic axis that has fewer than two of these in view."""

    def named(value: float, _: int) -> str:
        low, high = sorted(axis.get_view_interval())
        if low <= 0 or math.floor(math.log10(high)) > math.ceil(math.log10(low)):
            return ""
        lead = value / 10.0 ** math.floor(math.log10(value))
        return f"{value:.3g}" if high < 2 * low or min(abs(lead - each) for each in (2, 3, 5)) < 1e-6 else ""

    axis.set_minor_formatter(FuncFormatter(named))


def _power(value: float, _: int) -> str:
    """Return a power of ten as text."""
    return f"10{raised(round(math.log10(value)))}" if value > 0 else ""


def colour_bar(figure: Figure, image: ScalarMappable, label: str) -> None:
    """Draw a colour bar into the right margin (of at least 21 mm)."""
    width = float(figure.get_size_inches()[0]) * 25.4
    axes = figure.add_axes((1 - 18 / width, 0.2, 2.5 / width, 0.6), label="<colorbar>")
    figure.colorbar(image, cax=axes, label=label)


def said(analysis: Analysis, *more: str) -> str:
    """Say at which plane displacement was drawn, how it was filtered, and whether runout was subtracted."""
    where = plane_words({end: result.plane for end, result in analysis.ends.items() if result.seen})
    return " · ".join([f"Displacement {where}", *(more or ("not filtered",)), runout_words(analysis.checks)])


def plane_words(planes: Mapping[str, str]) -> str:
    """Return the plane at each end at which displacement is drawn."""
    if set(planes.values()) == {"bearing"}:
        return "at the bearing planes"
    return ", ".join(f"{end} at the {plane} plane" for end, plane in planes.items())


def mark_phases(ax: Axes, analysis: Analysis, names: bool = False) -> None:
    """Shade the phases of the drop behind a time axis, and name them above it where they are wide enough."""
    left, right = ax.get_xlim()
    for phase in analysis.phases:
        start, end = max(phase.start, left), min(phase.end, right)
        if end <= start:
            continue
        ax.axvspan(start, end, color=PHASE_COLOUR.get(phase.name, "white"), zorder=0, linewidth=0)
        if names:
            name = ax.annotate(
                phase.name,
                ((start + end) / 2, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 2),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=7,
                color=GREY,
            )
            if name.get_window_extent().width > (end - start) / (right - left) * ax.bbox.width:
                name.remove()
    ax.set_xlim(left, right)


def legend_below(figure: Figure, columns: int = 3) -> None:
    """One legend for the whole figure, below its axes; equal labels count once."""
    found: dict[str, Any] = {}
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if found:
        figure.legend(
            list(found.values()), list(found), loc="lower center", ncols=columns, frameon=False, borderaxespad=0.2
        )


def say(ax: Axes, words: str) -> None:
    """Say in the axes why they are empty or incomplete.

    Empty axes have no frame and no scale, for it would be invented, but for what they share with others.
    """
    ax.apply_aspect()
    points = ax.get_window_extent().width * 72 / ax.figure.dpi
    lines = textwrap.fill(words, max(8, int(0.9 * points / _LETTER_PT)), break_long_words=False)
    ax.text(0.5, 0.5, lines, transform=ax.transAxes, ha="center", va="center", color=GREY)
    if ax.has_data():
        return
    own = [
        axis
        for axis, shared in ((ax.xaxis, ax.get_shared_x_axes()), (ax.yaxis, ax.get_shared_y_axes()))
        if len(shared.get_siblings(ax)) == 1
    ]
    if len(own) == 2:
        ax.set_axis_off()
    for axis in own:
        axis.set_ticks([])
        axis.set_ticks([], minor=True)


def circled_ends(analysis: Analysis) -> list[str]:
    """Ends whose clearance circle is known."""
    return [end for end in analysis.seen_ends if has_circle(analysis, end)]


def has_circle(analysis: Analysis, end: str) -> bool:
    """Whether an end's clearance circle is known."""
    return analysis.ends[end].gap is not None


def centre_of(analysis: Analysis, end: str) -> np.ndarray:
    """Clearance centre of an end, m; the probes' zero where it is not known."""
    gap = analysis.ends[end].gap
    return np.zeros(2) if gap is None else gap.place
