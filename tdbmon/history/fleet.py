"""Many machines side by side: the latest drop of each, worst first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tdbmon.estimate import Estimate
from tdbmon.history.archive import Archive
from tdbmon.history.compare import Comparison, compare, filed_drop
from tdbmon.history.verdict import Verdict, verdict_of

_WORST = ("inspect", "changed", "too few drops", "as before")


@dataclass(frozen=True)
class Member:
    """A machine of the fleet.

    Attributes
    ----------
    machine : str
    drops : int
    comparison, verdict
        Of its latest drop.
    """

    machine: str
    drops: int
    comparison: Comparison
    verdict: Verdict

    @property
    def furthest(self) -> float:
        """Greatest difference of a judged quantity, in standard errors; 0 where none is known."""
        found = [
            abs(c.difference.value / c.difference.error)
            for c in self.comparison.changes
            if c.kind.judged and c.difference is not None and c.difference.error
        ]
        return max(found, default=0.0)

    def gaps(self) -> dict[str, list[tuple[int, Estimate]]]:
        """Radius at rest an end, with the number of the drop among the matching ones and the latest."""
        found = self.comparison
        number = {entry.id: i for i, entry in enumerate((*found.matched, found.entry), start=1)}
        return {
            c.end: [(number[drop], e) for drop, e in (*c.earlier, (found.entry.id, c.estimate)) if e.known]
            for c in found.changes
            if c.kind.name == "gap_um"
        }


def fleet(archive: Archive, progress: Callable[[str], None] = lambda _: None) -> list[Member]:
    """Return the machines of an archive, worst first."""
    members = []
    names = archive.machines()
    for i, name in enumerate(names, start=1):
        progress(f"machine {i} of {len(names)}: {name}")
        entries = archive.entries(name)
        found = compare(archive, filed_drop(archive, entries[-1].id))
        members.append(Member(name, len(entries), found, verdict_of(found)))
    return sorted(members, key=lambda m: (_WORST.index(m.verdict.word), -m.furthest, m.machine))
