"""The machines of an archive side by side, each by its worst standing alarm or else its latest drop; worst first."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial

from tdbmon.estimate import Estimate
from tdbmon.history.archive import Archive
from tdbmon.history.compare import Comparison
from tdbmon.history.standing import Judged, judge, standing
from tdbmon.history.verdict import WORST_FIRST, Verdict
from tdbmon.progress import Progress, silent

REASONS = 3  # most reasons of an alarm shown for a fleet; the machine's own report has all


@dataclass(frozen=True)
class Member:
    """A machine of the fleet.

    Attributes
    ----------
    machine : str
    drops : int
    synthetic : int
        Number of simulated drops.
    undated : int
        Number of drops without a time; they are ordered before those with one.
    latest : Judged
        Its latest drop.
    standing : tuple of Judged
        Its standing alarms, of any drop, the worst first.
    """

    machine: str
    drops: int
    synthetic: int
    undated: int
    latest: Judged
    standing: tuple[Judged, ...]

    @property
    def judged(self) -> Judged:
        """The drop that determines the machine's verdict: that of the worst standing alarm, else the latest."""
        return self.standing[0] if self.standing else self.latest

    @property
    def comparison(self) -> Comparison:
        """Of the drop by which it is judged."""
        return self.judged.comparison

    @property
    def verdict(self) -> Verdict:
        """Of the drop by which it is judged."""
        return self.judged.verdict

    @property
    def furthest(self) -> float:
        """Greatest difference of a judged feature, in standard errors; 0 if none is known."""
        found = [
            abs(c.difference.value / c.difference.error)
            for c in self.comparison.changes
            if c.kind.judged and c.difference is not None and c.difference.error
        ]
        return max(found, default=0.0)

    @property
    def gap_limits(self) -> dict[str, float]:
        """Alarm limit of the radius at rest of each end, m."""
        growth = self.comparison.settings.inspect.gap_growth
        found = {c.end: c.growth_from for c in self.comparison.changes if c.kind.name == "gap_um"}
        return {end: level * (1 + growth) for end, level in found.items() if level is not None}

    @property
    def hardest(self) -> tuple[str, float] | None:
        """End and Hertz stress (Pa) of the most loaded ball in the latest drop and its matching drops; None without forces."""
        found = self.latest.comparison.stress
        worst = [(end, max(box.greatest for _, box in boxes)) for end, boxes in found.items() if boxes]
        return max(worst, key=lambda each: each[1], default=None)

    def gaps(self) -> dict[str, list[tuple[int, Estimate]]]:
        """Radius at rest of each end, with the number of its drop among the matching ones and the one judged."""
        found = self.comparison
        number = {entry.id: i for i, entry in enumerate((*found.matched, found.entry), start=1)}
        return {
            c.end: [(number[drop], e) for drop, e in (*c.earlier, (found.entry.id, c.estimate)) if e.known]
            for c in found.changes
            if c.kind.name == "gap_um"
        }


def fleet(archive: Archive, progress: Progress = silent, machine: str = "") -> list[Member]:
    """Return the machines of an archive, or one of them, worst first."""
    members = []
    names = [machine] if machine else archive.machines()
    for i, name in enumerate(names, start=1):
        progress(f"machine {i} of {len(names)}: {name}")
        entries = archive.entries(name)
        judged = cache(partial(judge, archive))
        synthetic = sum(entry.synthetic for entry in entries)
        undated = sum(not entry.dropped for entry in entries)
        latest = judged(entries[-1].id)
        members.append(Member(name, len(entries), synthetic, undated, latest, standing(entries, judged)))
    return sorted(members, key=lambda m: (WORST_FIRST.index(m.verdict.word), -m.furthest, m.machine))
