"""Widths of a table's columns on paper, from the words in them."""

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
PAGE = 170 / 25.4 * 72  # between the margins of A4, pt
BESIDE = 3 / 25.4 * 72  # room between columns, pt
_SIZE = 8  # of the letters in a table, pt
_WORDS = 0.85  # of the page: whole words that take more leave too little to long cells
_STEPS = (4.0, 8.0, 16.0, 32.0, 64.0)  # by which widths are tried, pt
_SLACK = 0.5  # pt, what letters side by side may take beyond what is reckoned
_BREAK = "\u200b"  # a line may end here
_PARTS = re.compile(r"(?<=[-_./])(?=.)")  # of a word, which may stand on lines of their own


def column_widths(table: Table) -> list[float] | None:
    """Return the columns' widths, pt; None for a table that fits the page as it is.

    The widths are those, as far as one column's gain and another's loss tell, with which the table has the fewest lines.  No
    column is narrower than its longest word or part of one, as far as the page goes.
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
    """The words of a column, by their lengths.

    Attributes
    ----------
    wished : float
        Width with which every cell has one line, pt.
    word, part : float
        Widths of its longest word, and of the longest part of one, pt.
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
        """Return how many lines each cell takes; parts of lines count a little, so that widths move at all."""
        if width not in self._heights:
            room = width - BESIDE
            lines = [_lines(words, room) for words in self._words]
            self._heights[width] = np.array(lines) + 0.01 * self._long / room
        return self._heights[width]


def _least(columns: list[_Column]) -> Array:
    """Return the widths below which no column goes: of their words, where these do not fit of parts, else cut off."""
    words, parts = (np.array([getattr(column, name) for column in columns]) for name in ("word", "part"))
    if words.sum() <= _WORDS * PAGE:
        return words
    count = len(columns)
    return next(cut for n in range(1, count + 1) if (cut := np.minimum(parts, PAGE / n)).sum() <= PAGE + _SLACK)


def _lines(words: list[float], room: float) -> float:
    """Return how many lines words take that are set one after another, and broken where one is longer than a line."""
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
    """Return how many lines the rows of a table take."""
    heights = [column.heights(round(float(width), 3)) for column, width in zip(columns, widths, strict=True)]
    return float(np.max(heights, axis=0).sum())


def _moved(widths: Array, giver: int, taker: int, step: float) -> Array:
    """Return the widths after one column has given another some."""
    out = widths.copy()
    out[giver] -= step
    out[taker] += step
    return out


def breakable(text: str, width: float) -> str:
    """Return words in which those longer than a column of a width, pt, may break: after a mark, else anywhere."""

    def broken(word: str) -> str:
        if _width(word) + BESIDE <= width:
            return word
        return _BREAK.join(_BREAK.join(p) if _width(p) + BESIDE > width else p for p in _PARTS.split(word))

    return " ".join(map(broken, text.split(" ")))


def _width(text: str, bold: bool = False) -> float:
    """Return how long a line of text is, pt."""
    return sum(_advance(letter, bold) for letter in text)


@cache
def _advance(letter: str, bold: bool) -> float:
    """Return how far a letter moves the pen, pt; one that the fonts lack counts as their sign for that."""
    from matplotlib.ft2font import LoadFlags

    font = _font(bold)
    glyph = font.load_glyph(font.get_char_index(ord(letter)), flags=LoadFlags.NO_HINTING)
    return float(glyph.linearHoriAdvance) / 65536


@cache
def _font(bold: bool) -> FT2Font:
    """Return the letters of the reports, in the size of a table's."""
    from matplotlib import get_data_path
    from matplotlib.ft2font import FT2Font

    font = FT2Font(str(Path(get_data_path()) / "fonts" / "ttf" / f"DejaVuSans{'-Bold' if bold else ''}.ttf"))
    font.set_size(_SIZE, 72)
    return font
