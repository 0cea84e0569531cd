"""What of a drop bears no comparison, and why: "as before" must not be read of what was not seen."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.feature import place_of
from tdbmon.quantity import decapitalised, first_few

_NAMED = 4  # quantities with one reason


def not_compared(comparison: Comparison) -> dict[str, tuple[Change, ...]]:
    """Return the judged quantities that the drop, all drops before, or both lack, by end ("" for the rotor, the last)."""
    missing: dict[str, tuple[Change, ...]] = {}
    for change in (*comparison.changes, *comparison.untold):
        if comparison.matched and change.kind.judged and change.difference is None:
            missing[change.end] = (*missing.get(change.end, ()), change)
    return {end: missing[end] for end in sorted(missing, key=lambda end: (not end, place_of(end, comparison.ends)))}


def not_compared_sentences(comparison: Comparison) -> list[str]:
    """Return a sentence for each end: its quantities that bear no comparison, with the reasons."""
    if comparison.no_drop:
        return []  # the verdict says it of all
    return [
        f"not compared {_place(end)}: {'; '.join(_with_reasons(changes))}"
        for end, changes in not_compared(comparison).items()
    ]


def not_compared_count(comparison: Comparison) -> str:
    """Return how many quantities bear no comparison and where, as a cell of a table; the dash where all do."""
    counts = [f"{len(changes)} {_place(end)}" for end, changes in not_compared(comparison).items()]
    return ", ".join(counts) or "–"


def named(changes: Sequence[Change]) -> str:
    """Return the names of some quantities within a sentence, of many the first few and how many more."""
    return first_few([decapitalised(change.kind.title) for change in changes], _NAMED)


def _place(end: str) -> str:
    return f"at {end}" if end else "of the rotor"


def by_reason(changes: Iterable[Change]) -> dict[str, list[Change]]:
    """Return quantities that bear no comparison by the reason."""
    reasons: dict[str, list[Change]] = {}
    for change in changes:
        reasons.setdefault(change.why, []).append(change)
    return reasons


def _with_reasons(changes: tuple[Change, ...]) -> list[str]:
    return [named(alike) + (f" ({why})" if why else "") for why, alike in by_reason(changes).items()]
