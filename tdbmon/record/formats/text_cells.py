"""Lines of a table written as text, their cells, and which cells are numbers."""

from __future__ import annotations

import csv
import re
from typing import Any

COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
WORDS_FOR_NONE = {"", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "inf", "-inf", "+inf", "#n/a"}
_NUMBER = r"[-+]?(?:\d+{0}?\d*|{0}\d+)(?:[eEdD][-+]?\d+)?"
# by decimal sign: thousands, which a decimal sign must follow, or else they may be decimals themselves
_THOUSANDS = {",": r"[-+]?\d{1,3}(?:\.\d{3})+", ".": r"[-+]?\d{1,3}(?:,\d{3})+"}
_DATE = r"(?:\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}[./]\d{1,2}[./]\d{4})"
_HALF = r"\s*([aApP])\.?[mM]\.?"
_CLOCK = rf"\d{{1,2}}:\d{{2}}(?::\d{{2}})?(?:[.,]\d+)?(?:{_HALF})?"  # of two numbers minutes and seconds
DATE = re.compile(_DATE)
CLOCK = re.compile(_CLOCK)
HALF_OF_DAY = re.compile(rf"{_HALF}\s*$")
MOMENT = re.compile(rf"{_DATE}[T ]\s*{_CLOCK}\s*(?:Z|[-+]\d\d:?\d\d)?")
_NUMBERS = {
    sign: re.compile(rf"{_NUMBER.format(re.escape(sign))}|{thousands}{re.escape(sign)}\d+")
    for sign, thousands in _THOUSANDS.items()
}
_MOST_TIMES = 2  # cells, a day and a clock: more are the dates of the columns
_FEWEST_NUMBERED = 4  # columns


def split(line: str, separator: str) -> list[str]:
    """Split a line into its cells, quotes taken off; the separator " " stands for any white space."""
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def is_number(cell: str, decimal: str) -> bool:
    """Tell whether a cell is a number with this decimal sign."""
    return _NUMBERS[decimal].fullmatch(cell) is not None


def plain(texts: Any, decimal: str) -> Any:
    """Return a column of texts as Python writes numbers: with a decimal point, no thousands and no exponents of Fortran.

    A text with the other sign that parts no thousands is made no number.
    """
    thousands, other = _THOUSANDS[decimal], "." if decimal == "," else ","
    if texts.str.fullmatch(rf"{thousands}{re.escape(decimal)}\d+").any():
        whole = texts.str.fullmatch(rf"{thousands}(?:{re.escape(decimal)}\d+)?")
        texts = texts.mask(whole, texts.str.replace(other, "", regex=False))
    return texts.str.translate(str.maketrans({decimal: ".", other: "?", "d": "e", "D": "e"}))


def is_row(cells: list[str], decimal: str) -> bool:
    """Tell whether cells are a row of numbers, of which some may be missing, perhaps with a day, a clock or both."""
    filled = [cell for cell in cells if cell.lower() not in WORDS_FOR_NONE]
    others = [cell for cell in filled if not is_number(cell, decimal)]
    timed = all(MOMENT.fullmatch(cell) or CLOCK.fullmatch(cell) or DATE.fullmatch(cell) for cell in others)
    return bool(filled) and timed and (len(others) < len(filled) or len(filled) <= _MOST_TIMES)


def numbers_columns(cells: list[str], below: list[str]) -> bool:
    """Tell whether a row counts the columns, 1, 2, 3 ...; one that time goes on from, in the row below, measures."""
    if len(cells) < _FEWEST_NUMBERED or cells != [str(k + 1) for k in range(len(cells))]:
        return False
    first = below[0].replace(",", ".") if below else ""
    return not is_number(first, ".") or float(re.sub("[dD]", "e", first)) < 1
