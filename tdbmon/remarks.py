"""Remarks on several records as sentences, with similar ones merged; and the remark on rows left out of a table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from tdbmon.quantity import capitalised

_CHANNEL = re.compile(r"(?P<channel>[^\s:]+): (?P<words>.+)", re.DOTALL)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def grouped(remarks: Iterable[str], records: Sequence[str]) -> list[str]:
    """Return remarks as sentences, with similar ones merged (see `alike`)."""
    names = tuple(records)  # names of records are not capitalised
    return [_ended(each if each.startswith(names) else capitalised(each)) for each in alike(remarks, records)]


def alike(remarks: Iterable[str], records: Sequence[str]) -> list[str]:
    """Return remarks, merging those that differ only in record, channel and numbers.

    The first of them is kept in full, followed by the records and channels of the others.
    """
    kinds: dict[str, list[tuple[str, str, str]]] = {}
    for remark in remarks:
        record = next((name for name in records if remark.startswith(f"{name}: ")), "")
        words = remark.removeprefix(f"{record}: ")
        found = _CHANNEL.fullmatch(words) if record else None
        channel, words = (found["channel"], found["words"]) if found else ("", words)
        kinds.setdefault(_NUMBER.sub("#", words) if record else remark, []).append((record, channel, words))
    return [_joined(kind) for kind in kinds.values()]


def and_more(count: int) -> str:
    """Return the end of a caption that states the number of rows left out of a table; "" for none."""
    return f"; {count} more {'is' if count == 1 else 'are'} left out" if count > 0 else ""


def _joined(kind: list[tuple[str, str, str]]) -> str:
    record, channel, words = kind[0]
    told = ": ".join(part for part in (record, channel, words) if part)
    if not record or len(kind) == 1:
        return told
    others: dict[str, list[str]] = {}
    for where, which, _ in kind[1:]:
        others.setdefault(where, []).append(which)
    places = "; ".join(f"{where} {', '.join(filter(None, which))}".strip() for where, which in others.items())
    other_numbers = ", with other numbers," if len({said for _, _, said in kind}) > 1 else ""
    return f"{_ended(told)} The same{other_numbers} for {places}"


def _ended(words: str) -> str:
    return words if words.endswith("?") else f"{words}."
