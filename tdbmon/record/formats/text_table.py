"""Detection of the layout of a text table: its encoding, separator, decimal sign and header."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tdbsim.errors import InputError

from tdbmon.record.formats.text_cells import COMMENT, MOMENT, WORDS_FOR_NONE, is_number, is_row, numbers_columns, split
from tdbmon.record.formats.text_header import Header, header_of

_LONGEST_PREAMBLE = 5000  # lines before the first row of numbers
_LOOK = 50  # rows used to find separator and decimal sign, as the first may contain integers only


@dataclass(frozen=True)
class Layout:
    """Layout of a text table; `first` is the index of the first line of numbers."""

    separator: str  # " " stands for any white space
    decimal: str
    first: int
    header: Header


def decoded(raw: bytes) -> str:
    """Return the text of a file with line feeds as line ends.

    A byte-order mark determines the encoding; without one it is UTF-8 or, if that fails, Windows-1252.
    """
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = raw.decode("utf-16")
    else:
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = raw.decode("cp1252", "replace")
    # remove the DOS end-of-file mark and zeros of disk blocks allocated but never written
    text = text.rstrip("\x1a\0").replace("\r\n", "\n").replace("\r", "\n")
    return text.replace("∞", "inf")  # written by oscilloscopes for overrange


def layout_of(lines: list[str], path: Path) -> Layout:
    """Return the layout of a text table, detected from its first lines.

    Raises
    ------
    InputError
        If there is no row of numbers.
    """
    for first, line in enumerate(lines[:_LONGEST_PREAMBLE]):
        if not line.strip() or COMMENT.match(line) or not re.search(r"\d", line):
            continue
        separator, decimal = _signs(lines[first : first + _LOOK])
        cells = split(line, separator)
        if not is_row(cells, decimal) or not _goes_on(lines, first + 1, len(cells), separator, decimal):
            continue
        below = next((split(each, separator) for each in lines[first + 1 : first + _LOOK] if each.strip()), [])
        if not numbers_columns(cells, below):
            return Layout(separator, decimal, first, header_of(lines, first, separator, path))
    if any(line.strip() for line in lines):
        raise InputError(
            f"{path}: is text without a table of numbers; a record needs a row of names with rows of numbers below it"
            f"{_nearest_to_a_row(lines)}"
        )
    raise InputError(f"{path}: contains only empty lines; export it again")


def _signs(lines: list[str]) -> tuple[str, str]:
    """Return the separator and decimal sign, judged from a row of numbers and those that follow it."""
    line = lines[0]
    rows = [each for each in lines if each.strip() and not COMMENT.match(each)]
    for separator in ("\t", ";", "|"):
        if separator in line:
            return separator, _decimal(rows, separator)
    words = line.split()
    table = [row.split() for row in rows if len(row.split()) == len(words)]
    if len(words) > 1 and any("," in row for row in rows) and all(is_row(cells, ",") for cells in table):
        return " ", ","
    if "," in line:
        return ",", _decimal(rows, ",") if '"' in line else "."
    return (" " if len(words) > 1 and not MOMENT.fullmatch(line.strip()) else ","), "."


def _decimal(rows: list[str], separator: str) -> str:
    """Return the decimal sign of the majority of the cells."""
    cells = [cell for row in rows for cell in split(row, separator)]
    commas, points = (sum(sign in cell and is_number(cell, sign) for cell in cells) for sign in ",.")
    return "," if commas > points else "."


def _nearest_to_a_row(lines: list[str]) -> str:
    """Return a hint that quotes the line with the most numbers and its first invalid cell; "" if no line has a number."""
    most, told = 0, ""
    for k, line in enumerate(lines[:_LONGEST_PREAMBLE]):
        if not re.search(r"\d", line) or COMMENT.match(line):
            continue
        separator, decimal = _signs(lines[k : k + 1])
        cells = [cell for cell in split(line, separator) if cell.lower() not in WORDS_FOR_NONE]
        wrong = [cell for cell in cells if not is_row([cell], decimal)]
        if len(cells) - len(wrong) > most and wrong:
            most = len(cells) - len(wrong)
            told = (
                f". Line {k + 1} is the closest ('{line.strip()[:60]}'), but '{wrong[0][:40]}' is not a number, date or time:"
                " write numbers without thousands separators, and times as hours, minutes and seconds, or in seconds"
            )
    return told


def _goes_on(lines: list[str], start: int, width: int, separator: str, decimal: str) -> bool:
    """Tell whether the next nonempty line is also a row of numbers, or begins like one; True at the end of the text."""
    following = next((line for line in lines[start : start + 100] if line.strip() and not COMMENT.match(line)), None)
    if following is None:
        return True
    cells = split(following, separator)
    return is_row(cells, decimal) or (len(cells) == width and is_row(cells[:1], decimal))
