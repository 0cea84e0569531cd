"""Splitting of the lines of a text table into cells, and recognition of numbers, dates and times in them."""

from __future__ import annotations

import csv
import re
from typing import Any

COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
WORDS_FOR_NONE = {"", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "inf", "-inf", "+inf", "#n/a"}
_NUMBER = r"[-+]?(?:\d+{0}?\d*|{0}\d+)(?:[eEdD][-+]?\d+)?"
# by decimal sign: numbers with thousands separators; a decimal sign must follow, or the separator may be decimal itself
_THOUSANDS = {",": r"[-+]?\d{1,3}(?:\.\d{3})+", ".": r"[-+]?\d{1,3}(?:,\d{3})+"}
_DATE = r"(?:\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}[./]\d{1,2}[./]\d{4})"
_HALF = r"\s*([aApP])\.?[mM]\.?"
_CLOCK = rf"\d{{1,2}}:\d{{2}}(?::\d{{2}})?(?:[.,]\d+)?(?:{_HALF})?"  # two numbers are minutes and seconds
DATE = re.compile(_DATE)
CLOCK = re.compile(_CLOCK)
HALF_OF_DAY = re.compile(rf"{_HALF}\s*$")
MOMENT = re.compile(rf"{_DATE}[T ]\s*{_CLOCK}\s*(?:Z|[-+]\d\d:?\d\d)?")
_NUMBERS = {
    sign: re.compile(rf"{_NUMBER.format(re.escape(sign))}|{thousands}{re.escape(sign)}\d+")
    for sign, thousands in _THOUSANDS.items()
}
_MOST_TIMES = 2  # cells (date and time of day): a longer row of only dates and times is a header
_FEWEST_NUMBERED = 4  # columns


def split(line: str, separator: str) -> list[str]:
    """Return the cells of a line, without quotes; the separator " " stands for any white space."""
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def is_number(cell: str, decimal: str) -> bool:
    """Tell whether a cell is a number with the given decimal sign."""
    return _NUMBERS[decimal].fullmatch(cell) is not None


def plain(texts: Any, decimal: str) -> Any:
    """Return a column of texts in Python number syntax: decimal point, no thousands separators, no Fortran exponents.

    A text that contains the other sign, but not as a thousands separator, is made invalid.
    """
    thousands, other = _THOUSANDS[decimal], "." if decimal == "," else ","
    if texts.str.fullmatch(rf"{thousands}{re.escape(decimal)}\d+").any():
        whole = texts.str.fullmatch(rf"{thousands}(?:{re.escape(decimal)}\d+)?")
        texts = texts.mask(whole, texts.str.replace(other, "", regex=False))
    return texts.str.translate(str.maketrans({decimal: ".", other: "?", "d": "e", "D": "e"}))


def is_row(cells: list[str], decimal: str) -> bool:
    """Tell whether cells form a row of numbers, some of them possibly missing, with or without a date and a time of day."""
    filled = [cell for cell in cells if cell.lower() not in WORDS_FOR_NONE]
    others = [cell for cell in filled if not is_number(cell, decimal)]
    timed = all(MOMENT.fullmatch(cell) or CLOCK.fullmatch(cell) or DATE.fullmatch(cell) for cell in others)
    return bool(filled) and timed and (len(others) < len(filled) or len(filled) <= _MOST_TIMES)


def numbers_columns(cells: list[str], below: list[str]) -> bool:
    """Tell whether a row merely numbers the columns 1, 2, 3 ...; if the row below starts with 1 or more, it is data."""
    if len(cells) < _FEWEST_NUMBERED or cells != [str(k + 1) for k in range(len(cells))]:
        return False
    first = below[0].replace(",", ".") if below else ""
    return not is_number(first, ".") or float(re.sub("[dD]", "e", first)) < 1
