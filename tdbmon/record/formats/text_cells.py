"""Lines of a table written as text, their cells, and which cells are numbers."""

from __future__ import annotations

import csv
import re

COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
WORDS_FOR_NONE = {"", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "inf", "-inf", "+inf", "#n/a"}
_NUMBER = r"[-+]?(?:\d+{0}?\d*|{0}\d+)(?:[eEdD][-+]?\d+)?"
_DATE = r"(?:\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}[./]\d{1,2}[./]\d{4})"
_CLOCK = r"\d{1,2}:\d{2}(?::\d{2})?(?:[.,]\d+)?"  # of two numbers minutes and seconds
DATE = re.compile(_DATE)
CLOCK = re.compile(_CLOCK)
MOMENT = re.compile(rf"{_DATE}[T ]\s*{_CLOCK}\s*(?:Z|[-+]\d\d:?\d\d)?")
_NUMBERS = {sign: re.compile(_NUMBER.format(re.escape(sign))) for sign in ",."}
_FEWEST_NUMBERED = 4  # columns


def split(line: str, separator: str) -> list[str]:
    """Split a line into its cells, quotes taken off; the separator " " stands for any white space."""
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def is_number(cell: str, decimal: str) -> bool:
    """Tell whether a cell is a number with this decimal sign."""
    return _NUMBERS[decimal].fullmatch(cell) is not None


def is_row(cells: list[str], decimal: str) -> bool:
    """Tell whether cells are a row of numbers, dates and times, of which some may be missing."""
    filled = [cell for cell in cells if cell.lower() not in WORDS_FOR_NONE]
    return bool(filled) and all(
        is_number(cell, decimal) or MOMENT.fullmatch(cell) or CLOCK.fullmatch(cell) or DATE.fullmatch(cell)
        for cell in filled
    )


def numbers_columns(cells: list[str], below: list[str]) -> bool:
    """Tell whether a row counts the columns, 1, 2, 3 ...; one that time goes on from, in the row below, measures."""
    if len(cells) < _FEWEST_NUMBERED or cells != [str(k + 1) for k in range(len(cells))]:
        return False
    first = below[0].replace(",", ".") if below else ""
    return not is_number(first, ".") or float(re.sub("[dD]", "e", first)) < 1
