"""Widths of a table's columns on paper, from the words in them."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from tdbmon.report.document import Table

if TYPE_CHECKING:
    from matplotlib.ft2font import FT2Font

PAGE = 170 / 25.4 * 72  # between the margins of A4, pt
BESIDE = 3 / 25.4 * 72  # room between columns, pt
_SIZE = 8  # of the letters in a table, pt
_LONG = 0.4  # of the page: a longer cell is no reason for a wider column
_SLACK = 0.5  # pt, what letters side by side may take beyond what is reckoned
_BREAK = "\u200b"  # a line may end here
_PARTS = re.compile(r"(?<=[-_./])(?=.)")  # of a word, which may stand on lines of their own


def column_widths(table: Table) -> list[float] | None:
    """Return the columns' widths, pt; None for a table that fits the page as it is.

    A column that needs less than its share of the page gets what it needs; the others share the rest by what they hold.
    None is narrower than its longest word or part of one, as far as the page goes.
    """
    cells = [
        [(_width(head, bold=True)), *(_width(row.cells[k]) for row in table.rows)]
        for k, head in enumerate(table.header)
    ]
    wished = {k: max(each) + BESIDE + _SLACK for k, each in enumerate(cells)}
    if sum(wished.values()) <= PAGE:
        return None
    word = {k: min(_longest_word(table, k) + BESIDE + _SLACK, PAGE / len(cells)) for k in wished}
    widths: dict[int, float] = {}
    while narrow := [k for k in wished if wished[k] <= (PAGE - sum(widths.values())) / len(wished)]:
        widths |= {k: wished.pop(k) for k in narrow}
    # the longest cell alone would widen a column for one row, the mean alone make a tower of it
    held = {k: (min(most, _LONG * PAGE) * sum(cells[k]) / len(cells[k])) ** 0.5 for k, most in wished.items()}
    while short := [k for k, each in held.items() if word[k] > _share(held, k, widths)]:
        widths |= {k: word[k] for k in short}
        held = {k: each for k, each in held.items() if k not in short}
    widths |= {k: _share(held, k, widths) for k in held}
    return [widths[k] for k in range(len(cells))]


def breakable(text: str, width: float) -> str:
    """Return words in which those longer than a column of a width, pt, may break: after a mark, else anywhere."""

    def broken(word: str) -> str:
        if _width(word) + BESIDE <= width:
            return word
        return _BREAK.join(_BREAK.join(p) if _width(p) + BESIDE > width else p for p in _PARTS.split(word))

    return " ".join(map(broken, text.split(" ")))


def _share(held: dict[int, float], column: int, widths: dict[int, float]) -> float:
    """Return what a column gets of the page that those with a width leave."""
    return (PAGE - sum(widths.values())) * held[column] / sum(held.values())


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
