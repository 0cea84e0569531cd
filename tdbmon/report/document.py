"""A report as a tree of sections, paragraphs, tables and figures, from which every output format is written."""

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

_HEAVY_BYTES = 300_000  # a larger SVG takes more bytes than the PNG of the same figure
_DOTS_PER_INCH = 220  # of a PNG: sharp in print, and on a screen at twice its size


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text."""

    text: str


def sentence(text: str) -> Paragraph:
    """Return a text as a sentence: first letter capitalised, a full stop added unless it ends with a question mark."""
    return Paragraph(f"{capitalised(text)}{'' if text.endswith('?') else '.'}")


@dataclass(frozen=True)
class Verdict:
    """A highlighted finding; `tone` says whether it needs attention."""

    text: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Row:
    """Cells of a table row, the first being its heading."""

    cells: tuple[str, ...]
    tone: Tone = "plain"


@dataclass(frozen=True)
class Table:
    """A table with a caption, a header and rows with as many cells as the header."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[Row, ...]

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row.cells) != len(self.header):
                raise ValueError(f"table '{self.caption}': {len(row.cells)} cells under {len(self.header)} headings")


@dataclass(frozen=True)
class Image:
    """A rendered figure: SVG, or PNG if the SVG would be large."""

    kind: Literal["svg", "png"]
    data: bytes
    width_mm: float


@dataclass(frozen=True)
class Figure:
    """A figure, drawn by `draw` once, on first use, for all formats.

    Attributes
    ----------
    name : str
        Unique in the document; letters, digits and hyphens.
    caption : str
        What the figure shows and how to read it.
    alt : str
        Alternative text of one sentence for readers who cannot see it.
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
        """The rendered figure."""
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.backends.backend_svg import FigureCanvasSVG

        from tdbmon.figures.style import STYLE

        drawing = self.draw()
        width = float(drawing.get_size_inches()[0]) * 25.4
        out = io.BytesIO()
        # the salt makes the identifiers inside the SVG reproducible and unique to the figure; print_svg of the canvas draws
        # once, savefig twice
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
    """An interactive viewer of the signals; only formats that can zoom include it."""

    title: str
    signals: Signals


Block = Paragraph | Verdict | Table | Figure | SignalViewer


@dataclass(frozen=True)
class Section:
    """A part of the report with a heading."""

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
        Shown under the title, e.g. that the record is synthetic; empty for none.
    sections : tuple of Section
        The first one is the summary.
    """

    title: str
    subtitle: str
    sections: tuple[Section, ...]
    note: str = ""

    @property
    def made(self) -> str:
        """Program and version that made the report, for the page footer."""
        return f"tdbmon {__version__}"
