"""Features of a drop that were not compared, with the reason: "as before" does not cover them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.feature import place_of
from tdbmon.quantity import decapitalised, first_few

_NAMED = 4  # quantities named per reason


def not_compared(comparison: Comparison) -> dict[str, tuple[Change, ...]]:
    """Return the judged features missing in the drop, in all earlier ones, or in both, by end ("", the rotor, last)."""
    missing: dict[str, tuple[Change, ...]] = {}
    for change in (*comparison.changes, *comparison.untold):
        if comparison.matched and change.kind.judged and change.difference is None:
            missing[change.end] = (*missing.get(change.end, ()), change)
    return {end: missing[end] for end in sorted(missing, key=lambda end: (not end, place_of(end, comparison.ends)))}


def not_compared_sentences(comparison: Comparison) -> list[str]:
    """Return a sentence for each end: its features that were not compared, with the reasons."""
    if comparison.no_drop:
        return []  # covered by the verdict
    return [
        f"not compared {_place(end)}: {'; '.join(_with_reasons(changes))}"
        for end, changes in not_compared(comparison).items()
    ]


def not_compared_count(comparison: Comparison) -> str:
    """Return the number of features not compared, by end, as a table cell; a dash if there are none."""
    counts = [f"{len(changes)} {_place(end)}" for end, changes in not_compared(comparison).items()]
    return ", ".join(counts) or "–"


def named(changes: Sequence[Change]) -> str:
    """Return the names of features for use in a sentence; of many, the first few and the number of the others."""
    return first_few([decapitalised(change.kind.title) for change in changes], _NAMED)


def _place(end: str) -> str:
    return f"at {end}" if end else "of the rotor"


def by_reason(changes: Iterable[Change]) -> dict[str, list[Change]]:
    """Return features that were not compared, by reason."""
    reasons: dict[str, list[Change]] = {}
    for change in changes:
        reasons.setdefault(change.why, []).append(change)
    return reasons


def _with_reasons(changes: tuple[Change, ...]) -> list[str]:
    return [named(alike) + (f" ({why})" if why else "") for why, alike in by_reason(changes).items()]
