"""CSV and similar formats: tables of numbers as text."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from tdbsim.errors import InputError

from tdbmon.record.channel import Content, si_unit
from tdbmon.record.date import first_dated, iso_date
from tdbmon.record.formats.text_cells import CLOCK, COMMENT, DATE, HALF_OF_DAY, MOMENT, is_number, plain, split
from tdbmon.record.formats.text_table import Layout, decoded, layout_of
from tdbmon.record.tree import Branch, Leaf, channels_of, first_text, stated_date, stated_title

_TIME_WORD = re.compile(r"(?i)(?:time|zeit|temps|t)(?![^\W\d_])")  # at the beginning of a name
_WHOLE_SECOND = re.compile(r"(:\d\d:\d\d)(?![\d.])")
_CONTROL = bytes(set(range(32)) - set(b"\t\n\r\f\x1a"))


class CSV:
    """Text tables: a row of names, possibly one of units, and rows of numbers; separated by comma, semicolon, tab or blanks."""

    name = "CSV"
    extra: str | None = None

    def recognises(self, head: bytes, path: Path) -> bool:
        if head.startswith((b"\xff\xfe", b"\xfe\xff")):
            return len(head) > 2 and b"\0" in head
        text = head.rstrip(b"\0")
        return bool(text) and len(text.translate(None, _CONTROL)) == len(text)

    def read(self, path: Path) -> Content:
        lines = decoded(path.read_bytes()).split("\n")
        layout = layout_of(lines, path)
        leaves: list[Leaf] = []
        date = _stated_moment(layout.header.entries)
        columns = _columns(lines, layout, path)
        for name, unit, caption, column in zip(
            layout.header.names, layout.header.units, layout.header.captions, columns, strict=True
        ):
            attributes: dict[str, Any] = {"long_name": caption} if caption else {}
            if column is None:
                continue
            if column.began is not None:
                date = first_dated((date, column.began))
                attributes["unit"] = "s"
            elif unit is not None:
                attributes["unit"] = unit
            leaves.append(Leaf(name, column.values, attributes))
        leaves = _further_times(leaves)
        date = first_dated((date, _first_moment(lines, layout)))
        entries = layout.header.entries
        return Content(
            channels_of(Branch("", tuple(leaves), entries), path), stated_title(entries), date, _cut_off(lines)
        )


def _further_times(leaves: list[Leaf]) -> list[Leaf]:
    """Return the columns with further time columns between channels, such as ``t_speed [s]``, renamed to time.

    Such a column applies to the channels after it, sampled at another rate or at other times than those before it.
    """
    out = list(leaves)
    for i in range(2, len(leaves) - 1):
        values = leaves[i].values[: int(np.isfinite(leaves[i].values).sum())]  # shorter columns are padded with empty cells
        if (
            _counts_time(leaves[0])
            and _counts_time(leaves[i])
            and not (_counts_time(leaves[i - 1]) or _counts_time(leaves[i + 1]))
            and values.size > 1
            and bool(np.all(np.diff(values) > 0))
        ):
            out[0], out[i] = replace(leaves[0], name="time"), replace(leaves[i], name="time")
    return out


def _counts_time(leaf: Leaf) -> bool:
    return _TIME_WORD.match(leaf.name) is not None and si_unit(str(leaf.attributes.get("unit", "")))[0] == "s"


def _stated_moment(entries: Mapping[str, str]) -> str:
    """Return the date and time stated above the table, in one entry or in two; "" if none is stated."""
    date = stated_date(entries)
    clock = first_text(entries, ("time", "uhrzeit", "zeit", "time of day", "start time", "startzeit")) or ""
    moment = f"{date} {clock.replace(',', '.')}"
    # combine them if the result can be interpreted, or if the date alone cannot be either (for the report)
    both = date and ":" in clock and ":" not in date
    return moment if both and (iso_date(moment) or not iso_date(date)) else date


def _first_moment(lines: list[str], layout: Layout) -> str:
    """Return date and time of day of the first row, if the date has a column of its own; "" otherwise."""
    cells = split(lines[layout.first], layout.separator)
    day = next((cell for cell in cells if DATE.fullmatch(cell)), "")
    clock = next((cell for cell in cells if CLOCK.fullmatch(cell)), "").replace(",", ".")
    microseconds = re.sub(r"(\.\d{6})\d+", r"\1", clock)
    return f"{day} {microseconds}".strip() if day else ""


def _cut_off(lines: list[str]) -> str:
    """Return a warning if the last line has no line end and is shorter than the previous ones, as if truncated; else ""."""
    before = [len(line) for line in lines[-21:-1] if line.strip()]
    if lines[-1].strip() and len(before) == 20 and len(lines[-1]) < min(before):
        return "the last line is not terminated and is the shortest: its last number may have been cut off"
    return ""


@dataclass(frozen=True)
class _Column:
    """A column of numbers, or of date-times or seconds of a clock, then with the date of the first ("" if unknown)."""

    values: np.ndarray
    began: str | None = None


def _columns(lines: list[str], layout: Layout, path: Path) -> list[_Column | None]:
    """Return the columns of a table; None for one without name and values, or with dates beside a clock column."""
    below = enumerate(lines[layout.first :], start=layout.first + 1)
    body = {number: line for number, line in below if line.strip() and not COMMENT.match(line)}
    width = len(layout.header.names)
    _check_width(body, layout, width, path)
    separator = r"\s+" if layout.separator == " " else layout.separator
    table = pd.read_csv(
        io.StringIO("\n".join(body.values())), sep=separator, decimal=layout.decimal, header=None, names=list(range(width)),
        engine="c", float_precision="round_trip", skipinitialspace=True, index_col=False, low_memory=False,
    )  # fmt: skip
    return [_column(table[k], k, layout, list(body), path) for k in range(width)]


def _column(series: Any, k: int, layout: Layout, numbers: list[int], path: Path) -> _Column | None:
    """Return column `k`, whose rows are in the lines of the given `numbers`; None as in `_columns`."""
    name = layout.header.names[k]
    if series.dtype.kind in "iufb":
        if series.isna().all():
            if not name:
                return None  # rows end with a separator
            return _Column(np.asarray(series, dtype=np.float64))
        return _Column(np.asarray(series))
    texts = series.astype(str).str.strip()
    if MOMENT.fullmatch(texts.iloc[0]):
        return _moments(texts, name, path)
    if CLOCK.fullmatch(texts.iloc[0]):
        return _clocks(texts, name, path)
    if DATE.fullmatch(texts.iloc[0]):
        return None  # dates beside a clock column
    values = pd.to_numeric(plain(texts, layout.decimal), errors="coerce")
    wrong = np.flatnonzero(values.isna().to_numpy() & series.notna().to_numpy() & (texts != "").to_numpy())
    if wrong.size == 0:
        return _Column(np.asarray(values, dtype=np.float64))
    row = int(wrong[0])
    raise InputError(
        f"{path}: line {numbers[row]}, column '{name}': '{texts.iloc[row][:40]}' is not a number;"
        " correct the cell, or leave it empty where nothing was measured"
    )


def _moments(texts: Any, name: str, path: Path) -> _Column:
    texts = texts.str.replace(",", ".")
    try:
        if texts.iloc[0][:4].isdigit():
            halves = HALF_OF_DAY.search(texts.iloc[0])
            readings = [_dated(texts, "Ymd") if halves else pd.to_datetime(texts, format="ISO8601")]
        else:
            orders = ("dmY", "mdY") if "/" in texts.iloc[0] else ("dmY",)  # 03/11/2026 is ambiguous
            readings = [_dated(texts, order) for order in orders]
    except (ValueError, TypeError):
        raise InputError(f"{path}: column '{name}' contains date-times that cannot be read; write seconds instead") from None
    # at midnight the wrong order jumps by weeks; within a day both give the same times, and the date remains ambiguous
    lasting = [each.max() - each.min() for each in readings]
    right = readings[int(np.argmin(lasting))]
    open_day = len({str(each.iloc[0]) for each in readings}) > 1 and lasting[0] == lasting[-1]
    began = str(texts.iloc[0] if open_day else right.iloc[0].isoformat())
    in_one_zone = right if right.dt.tz is None else right.dt.tz_convert(None)
    return _Column(in_one_zone.to_numpy("datetime64[ns]"), began)


def _dated(texts: Any, order: str) -> Any:
    """Return date-times parsed with a common format; guessing the format of each one takes twenty times as long."""
    sign = texts.iloc[0].lstrip("0123456789")[0]
    day, clock = sign.join(f"%{each}" for each in order), "%H:%M:%S{}"
    if HALF_OF_DAY.search(texts.iloc[0]):
        texts, clock = texts.str.replace(HALF_OF_DAY, r" \1M", regex=True), "%I:%M:%S{} %p"
    for fraction in (".%f", ""):
        try:
            return pd.to_datetime(texts, format=f"{day} {clock.format(fraction)}")
        except ValueError:
            continue
    try:  # whole seconds mixed with fractional ones
        return pd.to_datetime(
            texts.str.replace(_WHOLE_SECOND, r"\1.0", regex=True), format=f"{day} {clock.format('.%f')}"
        )
    except ValueError:
        return pd.to_datetime(texts, dayfirst=order == "dmY", format="mixed")


def _clocks(texts: Any, name: str, path: Path) -> _Column:
    clocks = texts.str.replace(",", ".")
    halves = HALF_OF_DAY.search(clocks.iloc[0]) is not None
    bare = clocks.str.replace(HALF_OF_DAY, "", regex=True) if halves else clocks
    try:
        elapsed = pd.to_timedelta(bare.where(bare.str.count(":") > 1, bare + ":00" if halves else "00:" + bare))
    except (ValueError, TypeError):
        raise InputError(f"{path}: column '{name}' contains times that cannot be read; write seconds instead") from None
    if halves:
        half = pd.Timedelta(hours=12)
        elapsed = elapsed % half + clocks.str.contains("p", case=False).astype(int) * half
    seconds = np.array(elapsed.dt.total_seconds(), dtype=np.float64)
    seconds[1:] += 86400.0 * np.cumsum(np.diff(seconds) < -43200.0)  # midnight rollover
    return _Column(seconds, "")


def _check_width(body: Mapping[int, str], layout: Layout, width: int, path: Path) -> None:
    """Reject rows that are too short or too long, which a parser would silently pad or shift.

    `body` maps line numbers to rows.
    """
    plain_rows = layout.separator != " " and not any('"' in line for line in body.values())

    def cells_in(line: str) -> int:  # splitting takes ten times as long as counting
        return line.count(layout.separator) + 1 if plain_rows else len(split(line, layout.separator))

    wrong = next((number for number, line in body.items() if cells_in(line) != width), None)
    if wrong is None:
        return
    row = split(body[wrong], layout.separator)
    if not any(is_number(cell, layout.decimal) for cell in row):
        raise InputError(f"{path}: line {wrong} ('{body[wrong].strip()[:40]}') is not a row of numbers: delete it")
    last = " (the last: the file was cut off)" if wrong == max(body) else ""
    raise InputError(
        f"{path}: line {wrong}{last} has {len(row)} columns instead of {width}; correct or delete the line"
    )
