"""Parsing of the date stated in a file, in the forms that recorders and people use; ambiguous dates are rejected."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from datetime import datetime
from typing import ClassVar

from dateutil.parser import UnknownTimezoneWarning, parse, parserinfo

# UTC offset in s of unambiguous abbreviations: CST, IST and BST denote time zones on several continents
_ZONES = {
    zone: 3600 * hours
    for zone, hours in {
        "WET": 0, "WEST": 1, "CET": 1, "MEZ": 1, "CEST": 2, "MESZ": 2, "EET": 2, "EEST": 3, "MSK": 3, "JST": 9, "KST": 9,
        "AEST": 10, "AEDT": 11, "NZST": 12, "NZDT": 13, "EST": -5, "EDT": -4, "MDT": -6, "PST": -8, "PDT": -7,
    }.items()
}  # fmt: skip
# defaults for omitted fields: if the two results differ in the day, no full date was stated; if in the hour, no time
_LEFT_OUT = (datetime(2000, 1, 1, 0), datetime(2001, 2, 2, 1))
_DOTTED = re.compile(r"\d\.\s*\d{1,2}\.\s*\d")  # day first, by the standards of the countries that use this form
_WHOLE_YEAR_FIRST = re.compile(r"\d{4}\D")
_OFFSET_OF = re.compile(r"(UTC|GMT)\s*(?=[+-]\d)")  # its sign is reversed in POSIX notation


class _Words(parserinfo):
    """Month names in English and German for the date parser."""

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
    """Return a date, with or without a time, in ISO 8601; "" if it is not a date or ambiguous, such as 03/10/2026."""
    found = _readings(text)
    return found[0] if len(found) == 1 else ""


def first_dated(texts: Iterable[str]) -> str:
    """Return the first text that is a date, else the first that is not a number (such as a start in s); "" if none."""
    stated = [text for text in texts if text and not _is_number(text)]
    return next((text for text in stated if iso_date(text)), stated[0] if stated else "")


def unread_date(text: str) -> str:
    """Return why the date stated in a file could not be interpreted, with the remedy."""
    found = _readings(text)
    cure = "write it as 2026-03-31T18:30:00Z in the file, or file the drop with tdbmon archive add --dropped TIME"
    why = f"may be {' or '.join(found)}" if found else "is not understood"
    return f"the file states '{text}' as its date, which {why}, so that the time of the drop is not known: {cure}"


def _readings(text: str) -> list[str]:
    """Return all possible interpretations of a date text, in ISO 8601."""
    text = _OFFSET_OF.sub("", re.sub(r" (UTC|GMT)$", "Z", text.strip()))
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return list(dict.fromkeys(found for order in _orders(text) if (found := _read(text, *order))))
    return [text]


def _orders(text: str) -> list[tuple[bool, bool]]:
    """Return the possible orders of day, month and year in a text as pairs (day first, year first)."""
    if _WHOLE_YEAR_FIRST.match(text):
        return [(False, True)]
    return [(True, False)] if _DOTTED.search(text) else [(True, False), (False, False), (False, True)]


def _read(text: str, day_first: bool, year_first: bool) -> str:
    """Return a text parsed with the given order of day, month and year, in ISO 8601; "" if it states no full date."""
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
