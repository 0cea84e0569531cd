"""The date that a file states, in the ways that recorders and people write one; what could be two dates is none."""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import date, datetime, time, timedelta, timezone

_MONTHS = (
    ("january", "januar"), ("february", "februar"), ("march", "märz", "maerz", "mrz"), ("april",), ("may", "mai"),
    ("june", "juni"), ("july", "juli"), ("august",), ("september",), ("october", "oktober"), ("november",),
    ("december", "dezember"),
)  # fmt: skip
_SHORTEST = 3  # letters of a month
_WEEKDAY = re.compile(r"(?:mon|tue|wed|thu|fri|sat|sun|mo|di|mi|do|fr|sa|so)[a-z]*[.,]*\s+", re.IGNORECASE)
_CLOCK = re.compile(
    r"(?:^|[\sT,])(?P<h>\d{1,2}):(?P<m>\d\d)(?::(?P<s>\d\d)(?:[.,](?P<f>\d+))?)?\s*(?P<half>[ap]\.?m\b\.?)?"
    r"\s*(?P<zone>Z\b|(?:UTC|GMT)?\s*[+-]\d{1,2}(?::?\d\d)?(?!\d)|[A-Z]{3,4}\b)?",
    re.IGNORECASE,
)
_NUMBERS = re.compile(r"(\d{1,4})([./-])(\d{1,2})\2(\d{1,4})")
_NAMED = (
    re.compile(r"(?P<d>\d{1,2})(?:\.|th|st|nd|rd)?[\s-]*(?P<m>[^\W\d_]+)\.?[\s,-]*(?P<y>\d{4}|\d\d)", re.IGNORECASE),
    re.compile(r"(?P<m>[^\W\d_]+)\.?[\s-]*(?P<d>\d{1,2})(?:th|st|nd|rd)?[\s,-]+(?P<y>\d{4}|\d\d)", re.IGNORECASE),
    re.compile(r"(?P<y>\d{4})[\s-]*(?P<m>[^\W\d_]+)\.?[\s-]*(?P<d>\d{1,2})", re.IGNORECASE),
)
# h east of Greenwich, of abbreviations that have one meaning: CST, IST and BST are zones of several continents
_ZONES = {
    "UTC": 0, "GMT": 0, "Z": 0, "WET": 0, "WEST": 1, "CET": 1, "MEZ": 1, "CEST": 2, "MESZ": 2, "EET": 2, "EEST": 3,
    "MSK": 3, "JST": 9, "KST": 9, "AEST": 10, "AEDT": 11, "NZST": 12, "NZDT": 13, "EST": -5, "EDT": -4, "MDT": -6,
    "PST": -8, "PDT": -7,
}  # fmt: skip
_CENTURY = 69  # two digits from here on are of the last one, as C and POSIX have it


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
    text = text.strip()
    iso = re.sub(r" (UTC|GMT)$", "Z", text)
    try:
        datetime.fromisoformat(iso)
    except ValueError:
        pass
    else:
        return [iso]
    clock = _CLOCK.search(text)
    if clock is None:
        return [day.isoformat() for day in _days(text)]
    word, end = clock["zone"] or "", clock.end()
    if _month(word):  # 06:12:33 Mar 24 2020
        word, end = "", clock.start("zone")
    when, zone = _time(clock), _zone(word)
    if when is None or zone is None:
        return []
    days = _days(f"{text[: clock.start()]} {text[end:]}")
    return [f"{datetime.combine(day, when).isoformat()}{zone}" for day in days]


def _time(clock: re.Match[str]) -> time | None:
    hour, half = int(clock["h"]), (clock["half"] or "").lower()
    if half and not 1 <= hour <= 12:
        return None
    if half:
        hour = hour % 12 + 12 * half.startswith("p")
    try:
        return time(hour, int(clock["m"]), int(clock["s"] or 0), int((clock["f"] or "0")[:6].ljust(6, "0")))
    except ValueError:
        return None


def _zone(stated: str) -> str | None:
    """Return a zone as ISO 8601 writes it, "" where none is stated, None where its name tells no zone."""
    offset = re.fullmatch(r"(?:UTC|GMT)?\s*([+-])(\d{1,2}):?(\d\d)?", stated, re.IGNORECASE)
    if offset is not None:
        minutes = 60 * int(offset[2]) + int(offset[3] or 0)
        minutes = -minutes if offset[1] == "-" else minutes
    elif stated.lower() in ("", "uhr"):
        return ""
    elif stated.upper() in _ZONES:
        minutes = 60 * _ZONES[stated.upper()]
    else:
        return None
    if abs(minutes) >= 24 * 60:
        return None
    if minutes == 0:
        return "Z"
    return datetime(2000, 1, 1, tzinfo=timezone(timedelta(minutes=minutes))).isoformat()[-6:]


def _days(text: str) -> list[date]:
    """Return the days that a text without a clock may mean, each once."""
    text = re.sub(r"(?<=\d\.)\s+(?=\d)", "", " ".join(text.split()).strip(" ,;"))
    text = _WEEKDAY.sub("", text, count=1) if _WEEKDAY.match(text) else text
    for form in _NAMED:
        named = form.fullmatch(text)
        month = 0 if named is None else _month(named["m"])
        if named is not None and month:
            return _valid([(named["y"], month, named["d"])])
    numbers = _NUMBERS.fullmatch(text)
    if numbers is None:
        return []
    first, separator, second, third = numbers.groups()
    orders = [(third, second, first)]
    if len(first) == 4:
        orders = [(first, second, third)]
    elif separator != ".":  # with dots the day comes first, by the standards of the countries that write them
        orders += [(third, first, second)]
        orders += [(first, second, third)] if len(third) <= 2 else []
    return _valid(orders)


def _month(word: str) -> int:
    """Return the number of a month's name, English or German, in full or shortened; 0 where it is none."""
    if len(word) < _SHORTEST:
        return 0
    names = enumerate(_MONTHS, start=1)
    return next((number for number, of in names if any(name.startswith(word.lower()) for name in of)), 0)


def _valid(orders: list[tuple[str, int | str, str]]) -> list[date]:
    """Return those of (year, month, day) that exist, each once."""
    found: dict[date, None] = {}
    for year, month, day in orders:
        if len(year) not in (2, 4) or len(day) > 2:
            continue
        century = 0 if len(year) == 4 else (1900 if int(year) >= _CENTURY else 2000)
        try:
            found[date(century + int(year), int(month), int(day))] = None
        except ValueError:
            continue
    return list(found)


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return not iso_date(text)  # 20260331 is a date
