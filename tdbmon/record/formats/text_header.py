"""The header of a text table: rows of names, units and remarks above the numbers, and entries in the lines before them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tdbsim.errors import InputError
from tdbsim.units import si_unit_of, split_kind

from tdbmon.record.formats.text_cells import COMMENT, is_number, is_row, numbers_columns, split
from tdbmon.record.timebase import is_time_name, names_and_units, split_unit, time_factor

_MOST_ROWS = 3  # of names, units and remarks
_MOST_TOLD = 60  # lines: catman writes 29 items per channel
_FEWEST_NAMES = 3  # text cells in a line that make it a row of names
_REMARKS = {"comment", "comments", "kommentar", "bemerkung", "remark", "remarks", "note", "notes", "marker"}
_UNIT_LABELS = {"y_unit_label", "unit", "units", "einheit", "einheiten"}
_CLOCK_FORM = re.compile(r"(?i)h{1,2}:m{1,2}(:s{1,2}([.,:][a-z0]+)?)?")  # given instead of the unit of a clock column
_LABVIEW_TIME, _LABVIEW_END = "X_Value", "***End_of_Header***"
_WORD_AND_COLON = re.compile(r"[^\W\d][\w .-]*:\s")  # "date: Mar 31, 2026" is split at the colon, whatever the cell separator


@dataclass(frozen=True)
class Header:
    """Names, units and remarks as written, one per column, and entries such as ``fs = 20 kHz``."""

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    captions: tuple[str, ...]
    entries: Mapping[str, str]


def header_of(lines: list[str], first: int, separator: str, path: Path) -> Header:
    """Return the header of a table whose first row of numbers is the line with index `first`.

    Raises
    ------
    InputError
        If the row of names and the rows of numbers differ in their number of cells.
    """
    row = split(lines[first], separator)
    rows, at = _rows_far_above(lines, first, separator, row) or _rows_above(lines, first, separator, row)
    labelled = not row[0] and bool(rows) and all(cells[0] not in ("", _LABVIEW_TIME) for cells in rows)
    if labelled:  # the first column labels the header rows and is empty in the rows of numbers
        rows = [["", *cells[1:]] for cells in rows]
    if not [each for each in rows if not is_unit_row(each)]:
        _refuse_misfit(lines, at, separator, len(row), path)
    entries = _entries(lines[:at], separator)
    unit_rows = [k for k in range(len(rows)) if is_unit_row(rows[k])] if len(rows) > 1 else []
    units: list[str | None]
    if unit_rows:
        units = [cell.strip("[]()") for cell in rows.pop(unit_rows[-1])]
        likely = max(unit_rows[-1] - 1, 0)
    else:
        units = _labelled_units(lines[:at], separator, row)
        likely = len(rows) - 1
    if labelled:
        rows, likely = [max(rows, key=lambda cells: len(set(cells)))] if rows else [], 0
    names, captions = _names_and_captions(rows, likely, len(row))
    if not any(unit is not None for unit in units):
        split_name = _name_and_unit if any(_is_labelled_time(name) for name in names) else split_unit
        names, units = map(list, zip(*names_and_units(names, split_name), strict=True))
    if names[0] == _LABVIEW_TIME:
        names = ["time" if name == _LABVIEW_TIME else name for name in names]  # there is one per channel
        names[0] = "time" if row[0] else ""
        entries |= {} if row[0] else _labview_interval(entries)
    return Header(tuple(names), tuple(units), tuple(captions), entries)


def _rows_above(lines: list[str], first: int, separator: str, row: list[str]) -> tuple[list[list[str]], int]:
    """Return the rows of names, units and remarks, and the line index of the first of them."""
    rows: list[list[str]] = []
    at, apart = first, False
    while at > 0 and len(rows) < _MOST_ROWS:
        line = COMMENT.sub("", lines[at - 1])
        if not line.strip() and not rows:
            apart, at = True, at - 1
            continue
        cells = _fitted(line, separator, row)
        if cells is None or cells[0] == _LABVIEW_END:
            break
        empty, counted = not any(cells), numbers_columns(cells, row)
        if empty and rows:
            break
        if not empty and not counted:
            numbers = any(is_number(cell, sign) for cell in cells for sign in ",.")
            if numbers and not is_unit_row(cells):  # "1" may be a unit
                break
            rows.insert(0, cells)
        at -= 1
    named = len(row) >= _FEWEST_NAMES or any(is_time_name(cell) for cells in rows for cell in cells)
    if apart and not named:  # a remark followed by an empty line, not a row of names
        return [], first
    return rows, at if rows else first


def _rows_far_above(lines: list[str], first: int, separator: str, row: list[str]) -> tuple[list[list[str]], int] | None:
    """Return rows of names and units above many rows of further channel data, as catman writes them, and their line index."""
    below: list[str] = []
    for at in range(first - 1, max(first - _MOST_TOLD, -1), -1):
        cells = _fitted(lines[at], separator, row)
        if cells is None and lines[at].strip():
            return None
        if (
            cells is not None
            and first - at > _MOST_ROWS
            and is_time_name(cells[0])
            and is_unit_row(below)
            and len(set(cells)) == len(cells)
            and not any(is_row([cell], sign) for cell in cells for sign in ",.")
        ):
            return [cells, below], at
        below = cells or []
    return None


def _fitted(line: str, separator: str, row: list[str]) -> list[str] | None:
    """Return the cells of a header line matched to those of a row of numbers; None if their number does not fit."""
    cells = split(line, separator)
    if separator == " " and len(cells) != len(row):
        cells = re.split(r"\s{2,}|\t|[;,]\s*", line.strip())  # names may contain single blanks
    while len(cells) > len(row) and (not cells[-1] or cells[-1].lower() in _REMARKS):
        cells.pop()
    if 1 < len(cells) < len(row) and not any(row[len(cells) :]):  # rows end with a separator
        cells += [""] * (len(row) - len(cells))
    return cells if len(cells) == len(row) else None


def _names_and_captions(rows: list[list[str]], likely: int, width: int) -> tuple[list[str], list[str]]:
    """Return the names, from the row that names the time or else row `likely`, and the remarks, from the nearest other row."""
    if not rows:
        return [f"column_{k + 1}" for k in range(width)], [""] * width
    timed = [k for k in range(len(rows)) if any(is_time_name(cell) for cell in rows[k])]
    k = timed[-1] if timed else min(likely, len(rows) - 1)
    names, others = rows[k], [other for other in range(len(rows)) if other != k]
    if not others:
        return list(names), [""] * width
    other = min(others, key=lambda each: (abs(each - k), each))
    if len(set(names)) == width:
        return list(names), list(rows[other])
    upper, lower = (rows[each] for each in sorted((k, other)))
    joined = [below if above in ("", below) else f"{above}_{below}" for above, below in zip(upper, lower, strict=True)]
    return joined, [""] * width


def _refuse_misfit(lines: list[str], at: int, separator: str, width: int, path: Path) -> None:
    """Reject a row of names that does not fit the rows of numbers, as the assignment of names would be a guess."""
    k = next((k for k in range(at - 1, -1, -1) if lines[k].strip()), None)
    if k is None or separator == " ":
        return
    cells = split(COMMENT.sub("", lines[k]), separator)
    filled = [cell for cell in cells if cell]
    texts = is_unit_row(cells) or not any(is_number(cell, sign) for cell in filled for sign in ",.")
    if len(filled) < _FEWEST_NAMES or not texts or len(cells) == width:
        return
    if separator == "," and len(cells) < width <= 2 * len(cells):
        cause = "the comma seems to be both separator and decimal sign: export with ';' or tabs between the cells"
    else:
        cause = "correct the header, or export it again with one name per column"
    raise InputError(
        f"{path}: the header in line {k + 1} has {len(cells)} cells, the rows of numbers have {width}; {cause}"
    )


def is_unit_row(cells: list[str]) -> bool:
    """Tell whether a row contains the columns' units, some of which may be unknown."""
    texts = [cell.strip("[]() ") for cell in cells]
    filled = [text for text in texts if text]
    known = [text for text in filled if _says_a_unit(text)]
    if not filled:
        return False
    twice = len(set(filled)) < len(filled)
    if len(known) == len(filled):  # single capitals such as A or V may also be names
        return twice or any(not re.fullmatch("[A-Z]", text) for text in filled)
    bracketed = all(re.fullmatch(r"[\[(].*[\])]", cell) for cell in cells if cell)
    time_first = bool(texts[0]) and (time_factor(texts[0]) is not None or _CLOCK_FORM.fullmatch(texts[0]) is not None)
    return bracketed or (time_first and (twice or (2 * len(known) >= len(filled) and max(map(len, filled)) <= 6)))


def _split_label(label: str) -> tuple[str, str | None]:
    """Split a label in the notation of German standards, ``"Weg X1/mm"`` or ``"Drehzahl in 1/min"``, into name and unit."""
    for sign in re.finditer(r"\s*/\s*|\s+in\s+", label):
        name, unit = label[: sign.start()], label[sign.end() :].strip()
        unit = unit[1:-1] if re.fullmatch(r"\(.*\)", unit) else unit
        value = re.match(r"[-+]?[\d.]+(?!\s*/)", unit)  # a value with a unit, which unit libraries also accept
        if name and value is None and si_unit_of(unit) is not None:
            return name, unit
    return label, None


def _name_and_unit(label: str) -> tuple[str, str | None]:
    name, unit = _split_label(label)
    return split_unit(label) if unit is None else (name, unit)


def _is_labelled_time(label: str) -> bool:
    name, unit = _split_label(label)
    return unit is not None and is_time_name(name) and time_factor(unit) is not None


def _says_a_unit(text: str) -> bool:
    clock = _CLOCK_FORM.fullmatch(text) is not None
    return clock or text == "-" or si_unit_of(text) is not None or split_kind(text)[1] is not None


def _labelled_units(lines: list[str], separator: str, row: list[str]) -> list[str | None]:
    """Return the units from a row further up that is labelled as such, as in LabVIEW files; None for the time, which is in s."""
    for line in reversed(lines):
        label = line.split(separator, 1)[0].strip().lower()
        if label in _UNIT_LABELS and (cells := _fitted(line, separator, row)) is not None:
            return [None, *cells[1:]]
    return [None] * len(row)


def _labview_interval(entries: Mapping[str, str]) -> dict[str, str]:
    """Return the sampling interval of a LabVIEW file without times as entry ``dt``, if it is equal for all channels."""
    intervals = set(entries.get("Delta_X", "").split())
    return {"dt": intervals.pop()} if len(intervals) == 1 else {}


def _entries(lines: list[str], separator: str) -> dict[str, str]:
    """Return the entries in lines such as ``fs = 20 kHz`` or ``Sampling rate;20000`` above the header."""
    found: dict[str, str] = {}
    for line in lines:
        bare = COMMENT.sub("", line).strip()
        signs = (separator if separator != " " else "\t", "=", ":")
        for sign in (":", *signs) if _WORD_AND_COLON.match(bare) else signs:
            key, there, value = bare.partition(sign)
            if there and key.strip() and value.strip(f" {separator}"):
                key, value = key.strip(' "'), value.strip(f' "{separator}')
                cells = [value] if separator == " " else [cell for cell in value.split(separator) if cell]
                if len(cells) < 2 or key not in found:  # per-column dates must not replace the record's date
                    found[key] = cells[0] if len(set(cells)) == 1 else value
                break
    return found
