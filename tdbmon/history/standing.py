"""Alarms that still stand: a drop at another speed neither repeats an alarm nor clears it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.compare import Comparison, compare, filed_drop
from tdbmon.history.feature import Key
from tdbmon.history.matching import doubts
from tdbmon.history.sight import WEAR, sight
from tdbmon.history.verdict import WORST_FIRST, Verdict, verdict_of


@dataclass(frozen=True)
class Judged:
    """A drop, against those before it."""

    comparison: Comparison

    @cached_property
    def verdict(self) -> Verdict:
        """By the settings of its archive."""
        return verdict_of(self.comparison)

    @property
    def name(self) -> str:
        """The drop's record, with what tells it from others: time and speed."""
        entry = self.comparison.entry
        return f"{entry.raw_name} ({entry.when}, {entry.speed_words})"


def judge(archive: Archive, drop: str) -> Judged:
    """Compare a filed drop with those before it, and judge it."""
    return Judged(compare(archive, filed_drop(archive, drop)))


def standing(entries: Sequence[Entry], judged: Callable[[str], Judged]) -> tuple[Judged, ...]:
    """Return the alarms of a machine that stand: "inspect" before "changed" before "no drop", the latest first.

    An alarm stands until later drops of the same assembly at about the same speed show all that it is about: they then count
    instead.  Radius at rest, fall and deepest excursion of an end stand for each other, where growth up to the limit would have
    been seen.  A drop with too few before it clears nothing, nor does one whose record does not show its machine: that one is
    told while it is the latest.

    Parameters
    ----------
    entries : sequence of Entry
        All drops of the machine, in order.
    judged : callable
        Judges a drop, given its identifier.
    """
    clearing: list[Judged] = []
    alarms: list[Judged] = []
    for back, entry in enumerate(reversed(_since_assembled(entries))):
        doubted = bool(doubts(entry.failed_checks))
        later = [each for each in clearing if each.comparison.conditions.fits(entry)]
        if (doubted and back) or (later and _all_shown(_could_concern(later), later)):
            continue
        found = judged(entry.id)
        if not doubted and _counts(found.comparison):
            clearing.append(found)
        if found.verdict.alarm and not (later and _all_shown(found.verdict.concerns, later)):
            alarms.append(found)
    return tuple(sorted(alarms, key=lambda each: WORST_FIRST.index(each.verdict.word)))


def _counts(comparison: Comparison) -> bool:
    """Return whether a drop has so many before it that its verdict counts instead of earlier ones."""
    return len(comparison.matched) >= comparison.settings.compare.least_drops and comparison.telling > 0


def _could_concern(later: Sequence[Judged]) -> set[Key]:
    """Return what an alarm of a drop before could be about, without judging it: it may have a quantity, or have lost it."""
    return {change.key for each in later for change in each.comparison.changes}


def _all_shown(concerns: Iterable[Key], later: Sequence[Judged]) -> bool:
    """Return whether later drops show all quantities, each at least one of them."""
    return all(any(_shows(each.comparison, key) for each in later) for key in concerns)


def _shows(comparison: Comparison, key: Key) -> bool:
    """Return whether a drop shows a quantity, or what stands for it."""
    name, end = key
    if name in WEAR:
        return sight(comparison, end).enough
    return any(c.estimate.known for c in comparison.changes if c.key == key)


def standing_beside(archive: Archive, own: Judged) -> tuple[Judged, ...]:
    """Return the alarms of drops before one that still stand after it: its own verdict is not theirs.

    Parameters
    ----------
    archive : Archive
    own : Judged
        The drop, filed or not.
    """
    last = own.comparison.entry
    before = [e for e in archive.entries(last.machine) if e.id != last.id and e.order < last.order]
    found = standing([*before, last], lambda drop: own if drop == last.id else judge(archive, drop))
    return tuple(each for each in found if each is not own)


def _since_assembled(entries: Sequence[Entry]) -> Sequence[Entry]:
    """Return the drops of the assembly in service; where its word was left out later, that states no overhaul."""
    word = next((entry.assembly for entry in reversed(entries) if entry.assembly), "")
    first = next((i for i, entry in enumerate(entries) if entry.assembly == word), 0)
    return [entry for entry in entries[first:] if entry.assembly in (word, "")]
