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
_LINE_MM = 3.0  # height of a line of the note above a figure
_LEGEND_MM = 4.0  # height of a line of a legend
UM = 1e6
TITLE_LETTERS = 8  # longest file name within a longer title
_NARROW = 6.5  # font size of two lines in place of one
_LETTER_PT = 4.4  # mean width of a letter in figures

# Okabe and Ito, Color Universal Design (2008): distinguishable with every common colour vision
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7",
)  # fmt: skip
GREY, LIGHT = "#666666", "#DDDDDD"
_DROP_COLOURS = (BLUE, ORANGE, GREEN, VERMILION, PURPLE, GREY, SKY, BLACK)
_DROP_LINES = ("-", "--", "-.")
MEASURED = "#BBBBBB"  # drawn beneath the simulated curve
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
    "axes.titley": 1.0,  # fixed: searching for a free place takes a third of the drawing time
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
    "text.parse_math": False,  # names come from files: a dollar sign is literal
    "axes.unicode_minus": True,
    "svg.fonttype": "none",
    "figure.dpi": 150,
    "image.composite_image": True,
}


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Decorate a figure function so that it draws with the shared style."""

    @wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with rc_context(STYLE):
            return draw(*args, **kwargs)

    return inside


def new_figure(height_mm: float, note: str = "") -> Figure:
    """Return an empty figure of the page's width; `note` above it states what is drawn."""
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
    """Margins around and between the axes of a figure, mm.

    They are fixed, as matplotlib's constrained layout takes as long as all the drawing.  A test verifies that nothing is clipped.
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
    above = margins.top + _LINE_MM * sum(text.get_text().count("\n") for text in figure.texts)  # extra lines of a note
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
    """Return a file name shortened to at most `letters`, keeping beginning and end."""
    if len(name) <= letters:
        return name
    tail = (letters - 1) // 2
    return f"{name[: letters - 1 - tail]}…{name[len(name) - tail :]}"


def name_axis(ax: Axes, words: str, name: str) -> None:
    """Label the vertical axis with a file name in a text such as "{} force [kN]", no longer than the axis.

    If it does not fit, the name is put on a line of its own, and then shortened in its middle.
    """
    label, room = ax.set_ylabel(words.format(name)), ax.bbox.height
    two = words if "\n" in words else words.replace("{} ", "{}\n")
    for letters in range(len(name), 1, -1):
        if label.get_window_extent().height <= room:
            break
        label.set(text=two.format(clipped(name, letters)), fontsize=_NARROW, linespacing=1.0)


def drop_axis(ax: Axes, drops: int, most: int) -> None:
    """Number the drops along x with about `most` labels, integers only, even for a single drop."""
    # min_n_ticks=1: with one drop and two ticks required, the locator would use fractions
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=most, min_n_ticks=1))
    ax.set_xlim(0.4, drops + 0.6)


def interval_bar(ax: Axes, at: float, estimate: Estimate, factor: float, shift: float = 0.0, **look: Any) -> None:
    """Draw the 95 % interval of an estimate, if it has one, as a vertical bar, scaled by `factor` and shifted down."""
    if estimate.low is not None and estimate.high is not None:
        ax.plot([at, at], [estimate.low * factor - shift, estimate.high * factor - shift], **look)


def not_told(ax: Axes, drop: int, marker: str, place: int = 0) -> None:
    """Mark a drop without a value at the lower edge; each series of the axes at its own `place`."""
    ax.plot(
        drop, 0.07 + 0.1 * place, marker, color=GREY, markersize=3.5, markerfacecolor="none", markeredgewidth=0.7,
        linestyle="none", transform=ax.get_xaxis_transform(), label="no value in the drop judged",
    )  # fmt: skip


def power_ticks(axis: Axis) -> None:
    """Set ticks of a logarithmic axis at powers of ten, without mathtext, since names from files may contain dollar signs."""
    axis.set_major_locator(LogLocator(10.0))
    axis.set_major_formatter(FuncFormatter(_power))
    name_between(axis)


def name_between(axis: Axis) -> None:
    """Label some ticks between the powers of ten of a logarithmic axis if fewer than two powers are in view."""

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
    """Draw a colour bar in the right margin (of at least 21 mm)."""
    width = float(figure.get_size_inches()[0]) * 25.4
    axes = figure.add_axes((1 - 18 / width, 0.2, 2.5 / width, 0.6), label="<colorbar>")
    figure.colorbar(image, cax=axes, label=label)


def said(analysis: Analysis, *more: str) -> str:
    """Return a note on the plane of the displacement, its filtering, and whether run-out was subtracted."""
    where = plane_words({end: result.plane for end, result in analysis.ends.items() if result.seen})
    return " · ".join([f"Displacement {where}", *(more or ("not filtered",)), runout_words(analysis.checks)])


def plane_words(planes: Mapping[str, str]) -> str:
    """Return a text that states at which plane of each end displacement is drawn."""
    if set(planes.values()) == {"bearing"}:
        return "at the bearing planes"
    return ", ".join(f"{end} at the {plane} plane" for end, plane in planes.items())


def mark_phases(ax: Axes, analysis: Analysis, names: bool = False) -> None:
    """Shade the phases of the drop behind a time axis, and label them above it if they are wide enough."""
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
    """Draw one legend for the whole figure below its axes; equal labels are shown once."""
    found: dict[str, Any] = {}
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if found:
        figure.legend(
            list(found.values()), list(found), loc="lower center", ncols=columns, frameon=False, borderaxespad=0.2
        )


def say(ax: Axes, words: str) -> None:
    """Write a note in axes that says why they are empty or incomplete.

    Empty axes get no frame and no scale, which would be meaningless, except scales shared with other axes.
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
    """Return the ends whose clearance circle is known."""
    return [end for end in analysis.seen_ends if has_circle(analysis, end)]


def has_circle(analysis: Analysis, end: str) -> bool:
    """Whether an end's clearance circle is known."""
    return analysis.ends[end].gap is not None


def centre_of(analysis: Analysis, end: str) -> np.ndarray:
    """Return the clearance centre of an end, m; the probes' zero if it is not known."""
    gap = analysis.ends[end].gap
    return np.zeros(2) if gap is None else gap.place
