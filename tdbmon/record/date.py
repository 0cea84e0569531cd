"""The date that a file states, in the ways that recorders and people write one; what could be two dates is none."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from datetime import datetime
from typing import ClassVar

from dateutil.parser import UnknownTimezoneWarning, parse, parserinfo

# s east of Greenwich, of abbreviations that have one meaning: CST, IST and BST are zones of several continents
_ZONES = {
    zone: 3600 * hours
    for zone, hours in {
        "WET": 0, "WEST": 1, "CET": 1, "MEZ": 1, "CEST": 2, "MESZ": 2, "EET": 2, "EEST": 3, "MSK": 3, "JST": 9, "KST": 9,
        "AEST": 10, "AEDT": 11, "NZST": 12, "NZDT": 13, "EST": -5, "EDT": -4, "MDT": -6, "PST": -8, "PDT": -7,
    }.items()
}  # fmt: skip
# what a text leaves out is taken from these: where it makes another day, none was stated, and where another hour, no time
_LEFT_OUT = (datetime(2000, 1, 1, 0), datetime(2001, 2, 2, 1))
_DOTTED = re.compile(r"\d\.\s*\d{1,2}\.\s*\d")  # the day comes first, by the standards of the countries that write so
_WHOLE_YEAR_FIRST = re.compile(r"\d{4}\D")
_OFFSET_OF = re.compile(r"(UTC|GMT)\s*(?=[+-]\d)")  # which POSIX counts the other way round


class _Words(parserinfo):
    """Names of months in English and German."""

    JUMP: ClassVar[list[str]] = [*parserinfo.JUMP, "uhr"]
    MONTHS: ClassVar[list[tuple[str, ...]]] = [
        (*english, *german)
        for english, german in zip(
            parserinfo.MONTHS,
            [("Januar",), ("Februar",), ("März", "Mär", "Mrz", "Maerz"), (), ("Mai",), ("Juni",), ("Juli",), (), (),
             ("Oktober", "Okt"), (), ("Dezember", "Dez")],
            strict=True,
        )
    ]  # fmt: skip


def iso_date(text: str) -> str:
    """Return a date, with or without a time, in ISO 8601; "" where it is none, or two: 03/10/2026 is another day elsewhere."""
    found = _readings(text)
    return found[0] if len(found) == 1 else ""


def first_dated(texts: Iterable[str]) -> str:
    """Return the first text that is a date, else the first that is no number (a start in s, say) either; "" without."""
    stated = [text for text in texts if text and not _is_number(text)]
    return next((text for text in stated if iso_date(text)), stated[0] if stated else "")


def unread_date(text: str) -> str:
    """Say why a text that a file states as its date is not read, with the cure."""
    found = _readings(text)
    cure = "write it as 2026-03-31T18:30:00Z in the file, or file the drop with tdbmon archive add --dropped TIME"
    why = f"may be {' or '.join(found)}" if found else "is not understood"
    return f"the file states '{text}' as its date, which {why}, so that the time of the drop is not known: {cure}"


def _readings(text: str) -> list[str]:
    """Return all that a text may mean, in ISO 8601."""
    text = _OFFSET_OF.sub("", re.sub(r" (UTC|GMT)$", "Z", text.strip()))
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return list(dict.fromkeys(found for order in _orders(text) if (found := _read(text, *order))))
    return [text]


def _orders(text: str) -> list[tuple[bool, bool]]:
    """Return in which orders numbers may make a day: whether the day comes first, and whether the year."""
    if _WHOLE_YEAR_FIRST.match(text):
        return [(False, True)]
    return [(True, False)] if _DOTTED.search(text) else [(True, False), (False, False), (False, True)]


def _read(text: str, day_first: bool, year_first: bool) -> str:
    """Return what a text means with the numbers of its day in an order; "" where it states no whole day."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UnknownTimezoneWarning)
            one, other = (
                parse(text, _Words(), dayfirst=day_first, yearfirst=year_first, default=left_out, tzinfos=_ZONES)
                for left_out in _LEFT_OUT
            )
    except (ValueError, OverflowError, UnknownTimezoneWarning):
        return ""
    if one.date() != other.date():
        return ""
    return one.date().isoformat() if one.time() != other.time() else one.isoformat().replace("+00:00", "Z")


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return not iso_date(text)  # 20260331 is a date
