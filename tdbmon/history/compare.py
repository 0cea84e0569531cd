"""Comparison of a drop with earlier ones at matching conditions."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from dataclasses import dataclass, replace

from tdbmon.history import catalogue
from tdbmon.history.another_machine import Likeness, likeness
from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.change import Change, changes_of, untold_of
from tdbmon.history.difference import LEAST_JUDGED
from tdbmon.history.drop import Drop
from tdbmon.history.feature import place_of
from tdbmon.history.filing import StressBox
from tdbmon.history.life import Life, life_of
from tdbmon.history.matching import (
    Conditions,
    assembly_remarks,
    clock_remarks,
    conditions,
    counts,
    doubts,
    speed_remarks,
)
from tdbmon.history.settings import Settings
from tdbmon.quantity import counted

_MOST = 100  # latest matching drops used: older ones say little about today
_NAMED = 4  # drops without a time named in a remark


@dataclass(frozen=True)
class Comparison:
    """Comparison of a drop with earlier ones.

    Attributes
    ----------
    entry : Entry
    conditions : Conditions
        Matching conditions.
    matched : tuple of Entry
        The drops that it is compared with, in order.
    changes : tuple of Change
        All features of the drop or the earlier ones.
    untold : tuple of Change
        Judged features that neither the drop nor any earlier one has, fitted ones aside.
    ends : tuple of str
        As in the machine file.
    stress : dict
        By end: (drop, box) of all matching drops with forces, this one last.
    life : Life
    likeness : Likeness
        Whether it looks like a drop of this machine.
    foreign : str
        Remark if its record names another machine; else "".
    no_drop : str
        Remark if the shaft does not fall in its record; else "".
    remarks : tuple of str
        Reservations about the comparison.
    settings : Settings
    """

    entry: Entry
    conditions: Conditions
    matched: tuple[Entry, ...]
    changes: tuple[Change, ...]
    untold: tuple[Change, ...]
    ends: tuple[str, ...]
    stress: dict[str, tuple[tuple[str, StressBox], ...]]
    life: Life
    likeness: Likeness
    foreign: str
    no_drop: str
    remarks: tuple[str, ...]
    settings: Settings

    def record(self, drop: str) -> str:
        """Return the record name of this or a matching drop by its identifier; the identifier if unknown."""
        return next((e.raw_name for e in (*self.matched, self.entry) if e.id == drop), drop)

    @property
    def flagged(self) -> tuple[Change, ...]:
        """The judged features that differ, by increasing p-value."""
        return _least_probable_first(change for change in self.changes if change.flag)

    @property
    def noted(self) -> tuple[Change, ...]:
        """The features that differ but are not judged, by increasing p-value."""
        return _least_probable_first(change for change in self.changes if change.noted)

    @property
    def repeated(self) -> tuple[Change, ...]:
        """The features that are off as in earlier drops, after which they came back."""
        return tuple(change for change in self.changes if change.as_in)

    @property
    def drifting(self) -> tuple[Change, ...]:
        """The judged features with a significant trend whose value in this drop does not differ, by increasing p-value.

        In gradual wear no drop differs from its predecessors.
        """
        quiet = [c for c in self.changes if c.drifts and not c.differs and not c.as_in]
        found = [c for c in quiet if c.trend is not None and c.trend.slope.value]
        return tuple(sorted(found, key=lambda change: 1.0 if change.p_drift is None else change.p_drift))

    @property
    def tested(self) -> int:
        """Number of judged features with a p-value."""
        return self._with_probability(judged=True)

    @property
    def telling(self) -> int:
        """Number of judged features that could be flagged: those with a baseline of at least three drops."""
        return sum(
            c.kind.judged and c.difference is not None and c.difference.before.n >= LEAST_JUDGED for c in self.changes
        )

    @property
    def silent(self) -> int:
        """Number of judged features known in this drop with a baseline of fewer than three."""
        return sum(c.kind.judged and c.difference is not None for c in self.changes) - self.telling

    def detectable(self, change: Change) -> float | None:
        """Return the smallest difference of a feature that would be significant, corrected for multiple testing; None if none."""
        level = self.settings.compare.significance / max(1, self._with_probability(judged=change.kind.judged))
        return None if change.difference is None else change.difference.detectable(level)

    def drop_at(self, change: Change, index: int) -> str:
        """Return the identifier of the drop at an index of a change's trend."""
        return change.trend_drops(self.entry.id)[index]

    def _with_probability(self, *, judged: bool) -> int:
        return sum(c.kind.judged == judged and c.p_adjusted is not None for c in self.changes)


def filed_drop(archive: Archive, drop: str) -> Drop:
    """Return a filed drop for comparison (raises `InputError` if there is none)."""
    entry = archive.entry(drop)
    with catalogue.reading(archive.catalogue) as base:
        found = catalogue.features(base, [entry.result])[entry.result]
        boxes = catalogue.stress(base, [entry.result]).get(entry.result, ())
        result = catalogue.result(base, entry.id)
    filed = Drop(entry, found, boxes, result.version, result.machine_sha256, archive.ends(entry.id))
    if counts(entry):
        return filed
    filing = archive.filing(entry.id)
    return replace(filed, foreign=filing.foreign, no_drop=filing.no_drop)


def compare(archive: Archive, drop: Drop) -> Comparison:
    """Compare a drop with earlier drops of the archive at matching conditions.

    Parameters
    ----------
    archive : Archive
    drop : Drop
        From `filed_drop`, or from a record that is not filed.

    Returns
    -------
    Comparison
        Its verdict is in `tdbmon.history.standing.Judged`.
    """
    settings = archive.settings(drop.entry.machine)
    wanted = conditions(drop.entry, settings)
    with catalogue.reading(archive.catalogue) as base:
        of_machine = catalogue.entries(base, "machine = ?", (drop.entry.machine,))
        fitting = [e for e in of_machine if e.id != drop.entry.id and wanted.fits(e)]
        doubted = [e for e in fitting if doubts(e.failed_checks)]
        matched = [e for e in fitting if e not in doubted][-_MOST:]
        before = catalogue.features(base, [e.result for e in matched])
        boxes = catalogue.stress(base, [e.result for e in matched])
        fatigue, greatest = (
            catalogue.features(base, [e.result for e in of_machine], name)
            for name in ("fatigue_cycles", "stress_max_mpa")
        )
        other = _otherwise_made(base, drop, matched)
    changes = changes_of(drop, matched, before, settings)
    ends: dict[str, list[tuple[str, StressBox]]] = {}
    for entry in matched:
        for box in boxes.get(entry.result, ()):
            ends.setdefault(box.end, []).append((entry.id, box))
    for box in drop.stress:
        ends.setdefault(box.end, []).append((drop.entry.id, box))
    return Comparison(
        entry=drop.entry,
        conditions=wanted,
        matched=tuple(matched),
        changes=changes,
        untold=untold_of(drop, changes, len(matched)),
        ends=drop.ends,
        stress={end: tuple(ends[end]) for end in sorted(ends, key=lambda end: place_of(end, drop.ends))},
        life=life_of(drop, of_machine, fatigue, greatest, settings.life),
        likeness=likeness(archive, drop.entry, drop.features),
        foreign=drop.foreign,
        no_drop=drop.no_drop,
        remarks=(*_remarks(drop, of_machine, doubted, other), *_settings_remarks(archive, drop.entry.machine)),
        settings=settings,
    )


def _remarks(drop: Drop, of_machine: list[Entry], doubted: list[Entry], other: int) -> list[str]:
    """Return remarks on a comparison, given the doubted drops and the number of matching ones of other provenance."""
    entry = drop.entry
    remarks = [
        *clock_remarks(entry, of_machine),
        *assembly_remarks(entry, of_machine),
        *speed_remarks(entry, of_machine, next((f.estimate.why for f in drop.features if f.name == "initial_hz"), "")),
    ]
    timeless = [] if not entry.dropped else [e.raw_name for e in of_machine if not e.dropped]
    if timeless:
        verb = "counts" if len(timeless) == 1 else "count"
        remarks.append(
            f"{counted(len(timeless), 'drop')} of the machine without a time {verb} as earlier than all drops with"
            f" a time, whenever they fell ({', '.join(timeless[-_NAMED:])}): remove these and file them with --dropped TIME"
        )
    earlier = [e for e in of_machine if e.assembly == entry.assembly and e.order < entry.order]
    for left_out, why in (
        ([e for e in doubted if counts(e)], "not used for comparison, since checks of their records failed"),
        (
            [e for e in earlier if e.id != entry.id and not counts(e)],
            "neither used for comparison nor counted, since their records contain no drop or name another machine",
        ),
    ):
        names = ", ".join(f"{e.raw_name} ({', '.join(doubts(e.failed_checks))})" for e in left_out)
        remarks += [f"{why}: {names}"] if names else []
    if other:
        remarks.append(
            f"{other} of the matching drops were analysed with another version of tdbmon or another machine file: their"
            " values may differ for this reason; add them with --again to analyse them alike"
        )
    if entry.failed_checks:
        remarks.append(f"failed checks of the record: {', '.join(entry.failed_checks)}")
    return remarks


def _settings_remarks(archive: Archive, machine: str) -> list[str]:
    """Return remarks on settings for machines without drops: their name may differ from that in the machine file."""
    return [
        f"archive.toml has settings for machine '{name}', but no drop of it is filed; if this machine is meant, use its name"
        f" from the machine file: '{machine}'"
        for name in archive.settings_of_nobody()
    ]


def _otherwise_made(base: sqlite3.Connection, drop: Drop, matched: list[Entry]) -> int:
    """Return the number of drops analysed by another version or with another machine file."""
    results = (catalogue.result(base, entry.id) for entry in matched)
    return sum((r.version, r.machine_sha256) != (drop.version, drop.machine_sha256) for r in results)


def _least_probable_first(changes: Iterable[Change]) -> tuple[Change, ...]:
    return tuple(sorted(changes, key=lambda change: 1.0 if change.p is None else change.p))
