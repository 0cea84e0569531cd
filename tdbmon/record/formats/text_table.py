"""The layout of a table of numbers written as text: its encoding, separator, decimal sign and header."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tdbsim.errors import InputError
from tdbsim.units import si_unit_of

from tdbmon.record.timebase import split_unit, time_factor

_LONGEST_PREAMBLE = 5000  # lines before the first row of numbers
_COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
_NUMBER = r"[-+]?(?:\d+{0}?\d*|{0}\d+)(?:[eEdD][-+]?\d+)?"
_WORDS_FOR_NONE = {"", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "inf", "-inf", "+inf", "#n/a"}
_DATE = r"(?:\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}[./]\d{1,2}[./]\d{4})"
_CLOCK = r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?"
DATE = re.compile(_DATE)
CLOCK = re.compile(_CLOCK)
MOMENT = re.compile(rf"{_DATE}[T ]\s*{_CLOCK}\s*(?:Z|[-+]\d\d:?\d\d)?")


@dataclass(frozen=True)
class Layout:
    """How a text is to be read: `first` is the index of the first line of numbers; names and units as written."""

    separator: str  # " " stands for any white space
    decimal: str
    first: int
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    captions: tuple[str, ...]  # of an upper header row
    entries: Mapping[str, str]  # what the lines above the header say


def decoded(raw: bytes) -> str:
    """Return a text file's text, its lines ended by one line feed.

    A byte-order mark decides; without one it is UTF-8, and where that fails the encoding of western Windows.
    """
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = raw.decode("utf-16")
    else:
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = raw.decode("cp1252", "replace")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def layout_of(lines: list[str], path: Path) -> Layout:
    """Find the layout of a table from its first lines.

    Raises
    ------
    InputError
        If there is no row of numbers.
    """
    for first, line in enumerate(lines[:_LONGEST_PREAMBLE]):
        if not line.strip() or _COMMENT.match(line) or not re.search(r"\d", line):
            continue
        separator, decimal = _signs(line)
        cells = split(line, separator)
        if _is_row(cells, decimal) and _goes_on(lines, first + 1, len(cells), separator, decimal):
            return _with_header(lines, first, separator, decimal, len(cells))
    if any(line.strip() for line in lines):
        raise InputError(
            f"{path}: is text without a table of numbers; a record needs a row of names, and rows of numbers under it"
            f"{_nearest_to_a_row(lines)}"
        )
    raise InputError(f"{path}: holds empty lines only; export it again")


def split(line: str, separator: str) -> list[str]:
    """Split a line into its cells, quotes taken off."""
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def _signs(line: str) -> tuple[str, str]:
    """Return separator and decimal sign of a row of numbers."""
    for separator in ("\t", ";"):
        if separator in line:
            return separator, "," if "," in line else "."
    words = line.split()
    if "," in line:
        if len(words) > 1 and all(re.fullmatch(_NUMBER.format(","), word) for word in words):
            return " ", ","
        quoted = split(line, ",")
        return ",", "," if any("," in cell for cell in quoted) else "."
    return (" " if len(words) > 1 and not MOMENT.fullmatch(line.strip()) else ","), "."


def _is_row(cells: list[str], decimal: str) -> bool:
    number = re.compile(_NUMBER.format(re.escape(decimal)))
    filled = [cell for cell in cells if cell.lower() not in _WORDS_FOR_NONE]
    return bool(filled) and all(
        number.fullmatch(cell) or MOMENT.fullmatch(cell) or CLOCK.fullmatch(cell) or DATE.fullmatch(cell)
        for cell in filled
    )


def _nearest_to_a_row(lines: list[str]) -> str:
    """Quote the line of a text with the most numbers, and what in it is none; "" where none holds a number."""
    most, told = 0, ""
    for k, line in enumerate(lines[:_LONGEST_PREAMBLE]):
        if not re.search(r"\d", line) or _COMMENT.match(line):
            continue
        separator, decimal = _signs(line)
        cells = [cell for cell in split(line, separator) if cell.lower() not in _WORDS_FOR_NONE]
        wrong = [cell for cell in cells if not _is_row([cell], decimal)]
        if len(cells) - len(wrong) > most and wrong:
            most = len(cells) - len(wrong)
            told = (
                f". Line {k + 1} comes nearest ('{line.strip()[:60]}'), but '{wrong[0][:40]}' is no number, date or time:"
                " numbers need a plain form, without thousands separators, and times one of 24 hours, or seconds"
            )
    return told


def _goes_on(lines: list[str], start: int, width: int, separator: str, decimal: str) -> bool:
    """Tell whether the next line that is not empty is a row as well; a single row at the end counts."""
    following = next((line for line in lines[start : start + 100] if line.strip() and not _COMMENT.match(line)), None)
    if following is None:
        return True
    cells = split(following, separator)
    return len(cells) == width or _is_row(cells, decimal)


def _with_header(lines: list[str], first: int, separator: str, decimal: str, width: int) -> Layout:
    rows: list[list[str]] = []
    at = first
    while at > 0 and len(rows) < 3:
        line = _COMMENT.sub("", lines[at - 1])
        cells = split(line, separator)
        if separator == " " and len(cells) != width:
            cells = re.split(r"\s{2,}|\t|[;,]\s*", line.strip())  # names with a single blank in them
        while len(cells) > width and not cells[-1]:
            cells.pop()
        numbers = any(re.fullmatch(_NUMBER.format("[.,]"), cell) for cell in cells)
        if len(cells) != width or not any(cells) or (numbers and not _is_unit_row(cells)):  # "1" is a unit as well
            break
        rows.insert(0, cells)
        at -= 1
    entries = _entries(lines[:at], separator)
    units: list[str | None] = [None] * width
    if len(rows) > 1 and _is_unit_row(rows[-1]):
        units = [cell.strip("[]()") for cell in rows.pop()]
    names = rows[-1] if rows else [f"column_{k + 1}" for k in range(width)]
    captions = rows[-2] if len(rows) > 1 else [""] * width
    if len(set(names)) < width and len(rows) > 1:
        pairs = zip(captions, names, strict=True)
        names = [below if above in ("", below) else f"{above}_{below}" for above, below in pairs]
        captions = [""] * width
    if not any(unit is not None for unit in units):
        units = [split_unit(name)[1] for name in names]
        names = [split_unit(name)[0] for name in names]
    return Layout(separator, decimal, first, tuple(names), tuple(units), tuple(captions), entries)


def _is_unit_row(cells: list[str]) -> bool:
    texts = [cell.strip("[]() ") for cell in cells]
    filled = [text for text in texts if text]
    known = [text for text in filled if text == "-" or si_unit_of(text) is not None]
    if not filled:
        return False
    if len(known) == len(filled):  # single capitals may be the names A, B, or V as well
        return len(set(filled)) < len(filled) or any(not re.fullmatch("[A-Z]", text) for text in filled)
    bracketed = all(re.fullmatch(r"[\[(].*[\])]", cell) for cell in cells if cell)
    time_first = bool(texts[0]) and time_factor(texts[0]) is not None
    return bracketed or (time_first and 2 * len(known) >= len(filled) and max(map(len, filled)) <= 6)


def _entries(lines: list[str], separator: str) -> dict[str, str]:
    """Return what lines such as ``fs = 20 kHz`` or ``Sampling rate;20000`` above the header say."""
    found: dict[str, str] = {}
    for line in lines:
        bare = _COMMENT.sub("", line).strip()
        for sign in (separator if separator != " " else "\t", "=", ":"):
            key, there, value = bare.partition(sign)
            if there and key.strip() and value.strip(f" {separator}"):
                found[key.strip(' "')] = value.strip(f' "{separator}')
                break
    return found
