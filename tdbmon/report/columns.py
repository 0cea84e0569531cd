"""Column widths of a table on paper, from the text in its cells."""

from __future__ import annotations

import math
import re
from functools import cache
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tdbmon.report.document import Table

if TYPE_CHECKING:
    from matplotlib.ft2font import FT2Font

Array = NDArray[np.float64]
PAGE = 170 / 25.4 * 72  # width between the margins of A4, pt
BESIDE = 3 / 25.4 * 72  # space between columns, pt
_SIZE = 8  # font size in a table, pt
_WORDS = 0.85  # of the page: if unbroken words take more, too little is left for long cells
_STEPS = (4.0, 8.0, 16.0, 32.0, 64.0)  # steps of the width search, pt
_SLACK = 0.5  # pt, allowance for the difference between computed and set text width
_BREAK = "\u200b"  # zero-width space: a line may break here
_PARTS = re.compile(r"(?<=[-_./])(?=.)")  # splits a word into parts that may stand on separate lines


def column_widths(table: Table) -> list[float] | None:
    """Return the column widths, pt; None for a table that fits the page without wrapping.

    The widths minimise the number of lines of the table, by a local search that moves width from one column to another.  No
    column is narrower than its longest word, or part of a word, as far as the page permits.
    """
    columns = [_Column(head, [row.cells[k] for row in table.rows]) for k, head in enumerate(table.header)]
    wished = np.array([column.wished for column in columns])
    if wished.sum() <= PAGE:
        return None
    least = _least(columns)
    more = np.maximum(wished - least, _SLACK)
    widths = least + (PAGE - least.sum()) * more / more.sum()
    moves = [(a, b, step) for a, b in permutations(range(len(columns)), 2) for step in _STEPS]
    height = _height(columns, widths)
    while True:
        moved = [_moved(widths, *move) for move in moves if widths[move[0]] - move[2] >= least[move[0]]]
        found = [_height(columns, each) for each in moved]
        if not found or min(found) >= height:
            return [float(width) for width in widths]
        height, widths = min(found), moved[int(np.argmin(found))]


class _Column:
    """The text of a column, as widths of its words.

    Attributes
    ----------
    wished : float
        Width at which every cell fits on one line, pt.
    word, part : float
        Widths of its longest word, and of the longest part of a word, pt.
    """

    def __init__(self, head: str, cells: list[str]) -> None:
        self._words = [[_width(word, bold=True) for word in head.split()]]
        self._words += [[_width(word) for word in cell.split()] for cell in cells]
        self._long = np.array([_width(head, bold=True), *map(_width, cells)])
        parts = [_width(part) for cell in cells for word in cell.split() for part in _PARTS.split(word)]
        self.word = max((w for words in self._words for w in words), default=0.0) + BESIDE + _SLACK
        self.wished = float(self._long.max()) + BESIDE + _SLACK
        self.part = max([*self._words[0], *parts], default=0.0) + BESIDE + _SLACK
        self._heights: dict[float, Array] = {}

    def heights(self, width: float) -> Array:
        """Return the number of lines of each cell, plus a small term for partial lines that guides the search."""
        if width not in self._heights:
            room = width - BESIDE
            lines = [_lines(words, room) for words in self._words]
            self._heights[width] = np.array(lines) + 0.01 * self._long / room
        return self._heights[width]


def _least(columns: list[_Column]) -> Array:
    """Return the least column widths: of the longest words if these fit, else of the longest parts, truncated if need be."""
    words, parts = (np.array([getattr(column, name) for column in columns]) for name in ("word", "part"))
    if words.sum() <= _WORDS * PAGE:
        return words
    count = len(columns)
    return next(cut for n in range(1, count + 1) if (cut := np.minimum(parts, PAGE / n)).sum() <= PAGE + _SLACK)


def _lines(words: list[float], room: float) -> float:
    """Return the number of lines of words set one after another, with words longer than a line broken."""
    lines, used, space = 1.0, 0.0, _width(" ")
    for word in words:
        if used and used + space + word <= room:
            used += space + word
            continue
        over = math.ceil(word / room) - 1 if word > room else 0
        lines += over + bool(used)
        used = word - over * room
    return lines


def _height(columns: list[_Column], widths: Array) -> float:
    """Return the number of lines of all rows of a table."""
    heights = [column.heights(round(float(width), 3)) for column, width in zip(columns, widths, strict=True)]
    return float(np.max(heights, axis=0).sum())


def _moved(widths: Array, giver: int, taker: int, step: float) -> Array:
    """Return the widths after moving `step` from one column to another."""
    out = widths.copy()
    out[giver] -= step
    out[taker] += step
    return out


def breakable(text: str, width: float) -> str:
    """Return a text with break points in words wider than the column's width, pt: after punctuation, else anywhere."""

    def broken(word: str) -> str:
        if _width(word) + BESIDE <= width:
            return word
        return _BREAK.join(_BREAK.join(p) if _width(p) + BESIDE > width else p for p in _PARTS.split(word))

    return " ".join(map(broken, text.split(" ")))


def _width(text: str, bold: bool = False) -> float:
    """Return the width of a line of text, pt."""
    return sum(_advance(letter, bold) for letter in text)


@cache
def _advance(letter: str, bold: bool) -> float:
    """Return the advance width of a character, pt; a character missing in the fonts counts as their placeholder glyph."""
    from matplotlib.ft2font import LoadFlags

    font = _font(bold)
    glyph = font.load_glyph(font.get_char_index(ord(letter)), flags=LoadFlags.NO_HINTING)
    return float(glyph.linearHoriAdvance) / 65536


@cache
def _font(bold: bool) -> FT2Font:
    """Return the font of the reports in the size used for tables."""
    from matplotlib import get_data_path
    from matplotlib.ft2font import FT2Font

    font = FT2Font(str(Path(get_data_path()) / "fonts" / "ttf" / f"DejaVuSans{'-Bold' if bold else ''}.ttf"))
    font.set_size(_SIZE, 72)
    return font
