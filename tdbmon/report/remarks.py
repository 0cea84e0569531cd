"""Remarks on several records, those of one kind in one."""

from __future__ import annotations

import re
from collections.abc import Iterable

_PLACE = re.compile(r"(?P<record>[^:]+): (?:(?P<channel>[^\s:]+): )?(?P<words>.+)", re.DOTALL)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def grouped(remarks: Iterable[str]) -> list[str]:
    """Join remarks that say the same of several channels and records, apart from their numbers.

    The first of them is told whole, for the others where they hold.
    """
    kinds: dict[str, list[tuple[str, str, str]]] = {}
    for remark in remarks:
        found = _PLACE.fullmatch(remark)
        record, channel, words = (
            (found["record"], found["channel"] or "", found["words"]) if found else ("", "", remark)
        )
        key = _NUMBER.sub("#", words) if found else remark
        kinds.setdefault(key, []).append((record, channel, words))
    return [_joined(alike) for alike in kinds.values()]


def _joined(alike: list[tuple[str, str, str]]) -> str:
    record, channel, words = alike[0]
    told = ": ".join(part for part in (record, channel, words) if part)
    if len(alike) == 1:
        return told
    others: dict[str, list[str]] = {}
    for where, which, _ in alike[1:]:
        others.setdefault(where, []).append(which)
    places = "; ".join(f"{where} {', '.join(filter(None, which))}".strip() for where, which in others.items())
    return f"{told}. The same, with other numbers, of {places}"
