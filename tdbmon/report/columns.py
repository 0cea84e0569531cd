"""Widths of a table's columns on paper, from the words in them."""

from __future__ import annotations

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
_FILLED = 0.88  # of a line that does not end a cell
_STEPS = (4.0, 8.0, 16.0, 32.0, 64.0)  # by which widths are tried, pt
_SLACK = 0.5  # pt, what letters side by side may take beyond what is reckoned
_BREAK = "\u200b"  # a line may end here
_PARTS = re.compile(r"(?<=[-_./])(?=.)")  # of a word, which may stand on lines of their own


def column_widths(table: Table) -> list[float] | None:
    """Return the columns' widths, pt; None for a table that fits the page as it is.

    The widths are those, as far as one column's gain and another's loss tell, with which the table has the fewest lines.  No
    column is narrower than its longest word or part of one, as far as the page goes.
    """
    heads = [_width(head, bold=True) for head in table.header]
    cells = np.array([heads, *([_width(cell) for cell in row.cells] for row in table.rows)])
    wished = cells.max(axis=0) + BESIDE + _SLACK
    if wished.sum() <= PAGE:
        return None
    count = len(heads)
    least = np.minimum([_longest_word(table, k) + BESIDE + _SLACK for k in range(count)], PAGE / count)
    more = np.maximum(wished - least, _SLACK)
    widths = least + (PAGE - least.sum()) * more / more.sum()
    moves = [(a, b, step) for a, b in permutations(range(count), 2) for step in _STEPS]
    lines = _lines(cells, widths)
    while True:
        moved = [_moved(widths, *move) for move in moves if widths[move[0]] - move[2] >= least[move[0]]]
        found = [_lines(cells, each) for each in moved]
        if not found or min(found) >= lines:
            return [float(width) for width in widths]
        lines, widths = min(found), moved[int(np.argmin(found))]


def _lines(cells: Array, widths: Array) -> float:
    """Return how many lines the rows of a table take; those of the cells count a little."""
    room = widths - BESIDE - 0.9 * _SLACK
    lines = np.where(cells <= room, 1, np.ceil(cells / (_FILLED * room)))
    return float(lines.max(axis=1).sum() + 1e-3 * lines.sum())


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


def _longest_word(table: Table, column: int) -> float:
    words = [_width(word, bold=True) for word in table.header[column].split()]
    words += [_width(p) for row in table.rows for word in row.cells[column].split() for p in _PARTS.split(word)]
    return max(words, default=0.0)


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
