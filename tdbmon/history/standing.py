"""Standing alarms: a drop at another speed neither repeats nor clears an alarm."""

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
    """A drop's comparison with earlier ones and its verdict."""

    comparison: Comparison

    @cached_property
    def verdict(self) -> Verdict:
        """Verdict by the settings of the archive."""
        return verdict_of(self.comparison)

    @property
    def name(self) -> str:
        """Name of the drop's record, with time and speed to identify it."""
        entry = self.comparison.entry
        return f"{entry.raw_name} ({entry.when}, {entry.speed_words})"


def judge(archive: Archive, drop: str) -> Judged:
    """Compare a filed drop with earlier ones, and judge it."""
    return Judged(compare(archive, filed_drop(archive, drop)))


def standing(entries: Sequence[Entry], judged: Callable[[str], Judged]) -> tuple[Judged, ...]:
    """Return the standing alarms of a machine: "inspect" before "changed" before "no drop", the latest first of each.

    An alarm stands until later drops of the same assembly at about the same speed show all features that it concerns; these
    drops then count instead.  Radius at rest, fall time and deepest excursion of an end can replace each other if growth to the
    limit would have been detected.  A drop with too few earlier ones clears nothing, nor does one with a doubted record, whose
    alarm stands only while it is the latest.

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
    """Return whether a drop has enough earlier ones for its verdict to replace theirs."""
    return len(comparison.matched) >= comparison.settings.compare.least_drops and comparison.telling > 0


def _could_concern(later: Sequence[Judged]) -> set[Key]:
    """Return the features that an alarm of an earlier drop could concern, present or lost, without judging that drop."""
    return {change.key for each in later for change in each.comparison.changes}


def _all_shown(concerns: Iterable[Key], later: Sequence[Judged]) -> bool:
    """Return whether each feature is shown by at least one later drop."""
    return all(any(_shows(each.comparison, key) for each in later) for key in concerns)


def _shows(comparison: Comparison, key: Key) -> bool:
    """Return whether a drop shows a feature, or one that can replace it."""
    name, end = key
    if name in WEAR:
        return sight(comparison, end).enough
    return any(c.estimate.known for c in comparison.changes if c.key == key)


def standing_beside(archive: Archive, own: Judged) -> tuple[Judged, ...]:
    """Return the alarms of earlier drops that still stand after a drop, its own excluded.

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
    """Return the drops of the assembly in service; a later drop without an assembly does not imply an overhaul."""
    word = next((entry.assembly for entry in reversed(entries) if entry.assembly), "")
    first = next((i for i, entry in enumerate(entries) if entry.assembly == word), 0)
    return [entry for entry in entries[first:] if entry.assembly in (word, "")]
