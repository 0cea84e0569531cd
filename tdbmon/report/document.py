"""A report as one tree of sections, words, tables and figures, from which every output format is written."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from tdbmon import __version__
from tdbmon.quantity import capitalised
from tdbmon.report.palette import with_palette, with_palettes

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

    from tdbmon.report.signal import Signals

Tone = Literal["good", "attention", "plain"]

_HEAVY_BYTES = 300_000  # an SVG beyond this is heavier than the PNG of the same figure
_DOTS_PER_INCH = 220  # of a PNG: sharp in print, and on a screen at twice its size


@dataclass(frozen=True)
class Paragraph:
    """Plain words."""

    text: str


def sentence(text: str) -> Paragraph:
    """Return words as a sentence of its own: a capital in front, a stop behind where there is no question mark."""
    return Paragraph(f"{capitalised(text)}{'' if text.endswith('?') else '.'}")


@dataclass(frozen=True)
class Verdict:
    """A finding that stands out; `tone` says whether it asks for attention."""

    text: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Row:
    """Cells of a table's row, the first being its heading."""

    cells: tuple[str, ...]
    tone: Tone = "plain"


@dataclass(frozen=True)
class Table:
    """A table with a caption, a header and rows of as many cells."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[Row, ...]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row.cells) != len(self.header):
                raise ValueError(f"table '{self.caption}': {len(row.cells)} cells under {len(self.header)} headings")


@dataclass(frozen=True)
class Image:
    """A figure as drawn: SVG where that is light, PNG where it is not."""

    kind: Literal["svg", "png"]
    data: bytes
    width_mm: float


@dataclass(frozen=True)
class Figure:
    """A figure: `draw` makes it once, on first use, for all formats.

    Attributes
    ----------
    name : str
        Unique in the document; letters, digits and hyphens.
    caption : str
        What it shows and how to read it.
    alt : str
        The same for those who cannot see it, in a sentence.
    draw : callable
        Returns a matplotlib figure.
    """

    name: str
    caption: str
    alt: str
    draw: Callable[[], Drawing]

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z0-9-]+", self.name):
            raise ValueError(f"figure name '{self.name}' may hold small letters, digits and hyphens only")

    @cached_property
    def image(self) -> Image:
        """The figure, drawn."""
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.backends.backend_svg import FigureCanvasSVG

        from tdbmon.figures.style import STYLE

        drawing = self.draw()
        width = float(drawing.get_size_inches()[0]) * 25.4
        out = io.BytesIO()
        # the salt makes the identifiers inside the SVG the same in every run, and different in every figure; printing by
        # the canvas lays out and draws once, where savefig draws twice
        with rc_context({**STYLE, "svg.hashsalt": self.name}):
            FigureCanvasSVG(drawing).print_svg(out, metadata={"Date": None, "Creator": None})
            svg = with_palettes(out.getvalue())
            if len(svg) <= _HEAVY_BYTES:
                return Image("svg", svg, width)
            out = io.BytesIO()
            drawing.set_dpi(_DOTS_PER_INCH)  # drawing the SVG left it at 72
            FigureCanvasAgg(drawing).print_png(out, metadata={"Software": None})
        return Image("png", with_palette(out.getvalue()), width)


@dataclass(frozen=True)
class SignalViewer:
    """A place to look at the signals closely; only formats that can zoom have it."""

    title: str
    signals: Signals


Block = Paragraph | Verdict | Table | Figure | SignalViewer


@dataclass(frozen=True)
class Section:
    """A headed part of the report."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Document:
    """A report.

    Attributes
    ----------
    title : str
    subtitle : str
        Machine and drop, for the page header.
    note : str
        Said under the title, e.g. that the record is synthetic; empty for none.
    sections : tuple of Section
        The first one is the summary.
    """

    title: str
    subtitle: str
    sections: tuple[Section, ...]
    note: str = ""

    @property
    def made(self) -> str:
        """By what it was made, for the page footer."""
        return f"tdbmon {__version__}"
