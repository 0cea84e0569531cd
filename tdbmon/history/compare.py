"""A drop against those before it: what differs, by how much, and what that means."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tdbmon.estimate import Estimate
from tdbmon.history import catalogue
from tdbmon.history.another_machine import Likeness, likeness
from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.correction import corrected
from tdbmon.history.difference import LEAST_JUDGED, Difference, baseline, compare_value
from tdbmon.history.drop import Drop
from tdbmon.history.feature import KINDS, Feature, FeatureKind, in_order, place_of
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
from tdbmon.history.trend import Trend, order_p, trend_of
from tdbmon.quantity import counted

_MOST = 100  # of the matching drops before, the latest: older ones say little about today
_NAMED = 4  # drops without a time
_TREND = 60  # of the latest, for a trend
NO_SUCH = "this drop has no such end"  # why a quantity of earlier drops is missing, which its analysis does not know


@dataclass(frozen=True)
class Change:
    """One feature of the drop against the drops before.

    Attributes
    ----------
    kind : FeatureKind
    end : str
    estimate : Estimate
        Of the drop.
    earlier : tuple of (str, Estimate)
        Of the matching drops that have it, by identifier, in order.
    numbers : tuple of int
        Number of each of these among the matching drops, and that of the drop, which is the last.
    left_out : tuple of str
        Those of them that were off themselves, and are no measure for this drop.
    difference : Difference or None
        None where the drop or all those before lack the feature.
    p_adjusted : float or None
        Corrected for the number of features looked at: of those that are judged, or of those that are not.
    differs : bool
        By more than chance.
    p_drift : float or None
        Probability of its order over the drops (see `trend`), corrected for the number of judged features; None where it is
        not judged or the drop lacks it.
    drifts : bool
        It rises or falls from drop to drop by more than chance.
    why : str
        Why there is no difference.
    """

    kind: FeatureKind
    end: str
    estimate: Estimate
    earlier: tuple[tuple[str, Estimate], ...]
    numbers: tuple[int, ...]
    left_out: tuple[str, ...]
    difference: Difference | None
    p_adjusted: float | None
    differs: bool
    p_drift: float | None
    drifts: bool
    why: str

    @property
    def flag(self) -> bool:
        """True where a judged feature differs: it changed."""
        return self.differs and self.kind.judged

    @property
    def noted(self) -> bool:
        """True where a feature that is not judged differs: it is told beside the verdict."""
        return self.differs and not self.kind.judged

    @property
    def title(self) -> str:
        """Name and end, as a report says it."""
        return self.kind.title_at(self.end)

    @property
    def p(self) -> float | None:
        """Probability of so large a difference by chance, not corrected; None where it is not known."""
        return None if self.difference is None else self.difference.p

    @property
    def since(self) -> str:
        """Identifier of the first of the drops just before this one that were off in the same way; "" where none was."""
        first = ""
        if self.difference is None:
            return first
        for drop, estimate in reversed(self.earlier):
            off = (estimate.value or 0.0) - self.difference.before.centre
            if drop not in self.left_out or off * self.difference.value <= 0:
                break
            first = drop
        return first

    @property
    def series(self) -> tuple[Estimate, ...]:
        """Over the matching drops and this one, the latest sixty, as far as they have it."""
        earlier = tuple(e for _, e in self.earlier[-_TREND:])
        return (*earlier, self.estimate) if self.estimate.known else earlier

    @cached_property
    def trend(self) -> Trend | None:
        """Its course over `series`; None below four."""
        numbers = self.numbers if self.estimate.known else self.numbers[:-1]
        return trend_of(self.series, numbers[-len(self.series) :])

    @property
    def grown(self) -> float | None:
        """By which share it has grown beyond chance: over the drops before, or over the first of them where it drifts.

        None where it has not, or where what it is held against is not above zero.
        """
        grown = []
        if self.differs and self.difference is not None and self.difference.before.centre > 0:
            grown.append(self.difference.value / self.difference.before.centre)
        if self.drifts and self.trend is not None and self.trend.grown is not None:
            grown.append(self.trend.grown)
        return max(grown, default=None)

    def trend_drops(self, current: str) -> list[str]:
        """Return the identifiers of the drops that the trend goes over, given that of the drop compared."""
        return [drop for drop, _ in self.earlier[-_TREND:]] + ([current] if self.estimate.known else [])


@dataclass(frozen=True)
class Comparison:
    """A drop against those before.

    Attributes
    ----------
    entry : Entry
    conditions : Conditions
        What counts as matching.
    matched : tuple of Entry
        The drops that it was compared with, in order.
    changes : tuple of Change
        Every feature that the drop or those before have.
    untold : tuple of Change
        The judged features that neither the drop nor any before has, those of the fitted simulation aside.
    ends : tuple of str
        As in the machine file.
    stress : dict
        By end: (drop, box) of all matching drops with forces, this one last.
    life : Life
    likeness : Likeness
        Whether it looks like a drop of this machine at all.
    foreign : str
        What to tell where its record names another machine; "" where it does not.
    no_drop : str
        What to tell where the shaft does not fall in its record; "" where it does.
    remarks : tuple of str
        What to know when reading it.
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
        """Return the record's name of a matching drop, given its identifier."""
        return next((e.raw_name for e in (*self.matched, self.entry) if e.id == drop), drop)

    @property
    def flagged(self) -> tuple[Change, ...]:
        """The features that changed, the least probable first."""
        return _least_probable_first(change for change in self.changes if change.flag)

    @property
    def noted(self) -> tuple[Change, ...]:
        """The features that differ by more than chance and do not count towards the verdict, the least probable first."""
        return _least_probable_first(change for change in self.changes if change.noted)

    @property
    def drifting(self) -> tuple[Change, ...]:
        """The judged features that rise or fall from drop to drop without standing out, the clearest first.

        The drops before lie on the same slope, so that none of them differs from those before it.
        """
        found = [c for c in self.changes if c.drifts and not c.differs and c.trend is not None and c.trend.slope.value]
        return tuple(sorted(found, key=lambda change: 1.0 if change.p_drift is None else change.p_drift))

    @property
    def tested(self) -> int:
        """How many of the judged features have a probability."""
        return self._with_probability(judged=True)

    @property
    def telling(self) -> int:
        """How many of the judged features could be called off: those that at least three drops before have too."""
        return sum(
            c.kind.judged and c.difference is not None and c.difference.before.n >= LEAST_JUDGED for c in self.changes
        )

    @property
    def silent(self) -> int:
        """How many of the judged features are known of this drop and of fewer than three before."""
        return sum(c.kind.judged and c.difference is not None for c in self.changes) - self.telling

    def level_of(self, change: Change) -> float:
        """Return the probability below which a change is called off, corrected for how many are looked at with it."""
        return self.settings.compare.significance / max(1, self._with_probability(judged=change.kind.judged))

    def _with_probability(self, *, judged: bool) -> int:
        return sum(c.kind.judged == judged and c.p_adjusted is not None for c in self.changes)


def filed_drop(archive: Archive, drop: str) -> Drop:
    """Return a drop of the archive to compare (raises `InputError` where there is no such)."""
    entry = archive.entry(drop)
    with catalogue.reading(archive.catalogue) as base:
        found = catalogue.features(base, [entry.result])[entry.result]
        boxes = catalogue.stress(base, [entry.result]).get(entry.result, ())
        version, machine = catalogue.maker(base, entry.result)
    filed = Drop(entry, found, boxes, version, machine, archive.ends(entry.id))
    if counts(entry):
        return filed
    filing = archive.filing(entry.id)
    return replace(filed, foreign=filing.foreign, no_drop=filing.no_drop)


def compare(archive: Archive, drop: Drop) -> Comparison:
    """Compare a drop with the drops of the archive before it, at matching conditions.

    Parameters
    ----------
    archive : Archive
    drop : Drop
        From `filed_drop`, or of a record that is not filed.

    Returns
    -------
    Comparison
        `tdbmon.history.verdict.verdict_of` judges it.
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
    changes = _changes(drop, matched, before, settings)
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
        untold=_untold(drop, changes, len(matched)),
        ends=drop.ends,
        stress={end: tuple(ends[end]) for end in sorted(ends, key=lambda end: place_of(end, drop.ends))},
        life=life_of(drop, of_machine, fatigue, greatest, settings.life),
        likeness=likeness(archive, drop.entry, drop.features),
        foreign=drop.foreign,
        no_drop=drop.no_drop,
        remarks=(*_remarks(drop.entry, of_machine, doubted, other), *_settings_remarks(archive, drop.entry.machine)),
        settings=settings,
    )


def _remarks(entry: Entry, of_machine: list[Entry], doubted: list[Entry], other: int) -> list[str]:
    """Return what to know when reading a comparison, given the drops that were left out and how many were made otherwise."""
    remarks = [
        *clock_remarks(entry, of_machine),
        *assembly_remarks(entry, of_machine),
        *speed_remarks(entry, of_machine),
    ]
    timeless = [] if not entry.dropped else [e.raw_name for e in of_machine if not e.dropped]
    if timeless:
        verb = "counts" if len(timeless) == 1 else "count"
        remarks.append(
            f"{counted(len(timeless), 'drop')} of the machine without a time {verb} as earlier than all that state one,"
            f" whenever they fell ({', '.join(timeless[-_NAMED:])}): remove such and file them with --dropped TIME"
        )
    earlier = [e for e in of_machine if e.assembly == entry.assembly and e.order < entry.order]
    for left_out, why in (
        ([e for e in doubted if counts(e)], "not compared with, since checks of their records failed"),
        (
            [e for e in earlier if e.id != entry.id and not counts(e)],
            "neither compared with nor counted, since their records hold no drop or name another machine",
        ),
    ):
        names = ", ".join(f"{e.raw_name} ({', '.join(doubts(e.failed_checks))})" for e in left_out)
        remarks += [f"{why}: {names}"] if names else []
    if other:
        remarks.append(
            f"{other} of the matching drops were analysed with another version of tdbmon or another machine file: their"
            " values may differ for that reason; add them with --again to have them analysed alike"
        )
    if entry.failed_checks:
        remarks.append(f"checks of the record that failed: {', '.join(entry.failed_checks)}")
    return remarks


def _settings_remarks(archive: Archive, machine: str) -> list[str]:
    """Return for whom there are settings that nobody has: a name that is written otherwise than in the machine file, say."""
    return [
        f"archive.toml has settings for a machine '{name}', of which no drop is filed; if it is this one, write its name as"
        f" its machine file does: '{machine}'"
        for name in archive.settings_of_nobody()
    ]


def _otherwise_made(base: sqlite3.Connection, drop: Drop, matched: list[Entry]) -> int:
    """How many drops were analysed by another version or with another machine file."""
    mine = (drop.version, drop.machine_sha256)
    return sum(catalogue.maker(base, entry.result) != mine for entry in matched)


def _changes(
    drop: Drop, matched: list[Entry], before: dict[int, tuple[Feature, ...]], settings: Settings
) -> tuple[Change, ...]:
    mine = {(f.name, f.end): f.estimate for f in drop.features}
    theirs: dict[tuple[str, str], list[tuple[str, Estimate]]] = {}
    for entry in matched:
        for feature in before[entry.result]:
            if feature.estimate.known:
                theirs.setdefault((feature.name, feature.end), []).append((entry.id, feature.estimate))
    keys = [key for key in mine if key[0] in KINDS and (mine[key].known or key in theirs)]
    keys += [key for key in theirs if key not in mine and key[0] in KINDS]
    keys = in_order(keys, drop.ends)
    judged = sum(KINDS[name].judged for name, _ in keys)
    level = settings.compare.significance
    place = {entry.id: number for number, entry in enumerate(matched)}
    found = []
    for key in keys:
        earlier = theirs.get(key, [])
        numbers = (*(place[drop] for drop, _ in earlier), len(matched))
        found.append(_compared(key, mine.get(key), earlier, numbers, level / max(1, judged)))
    # what counts towards the verdict and what does not are each corrected for their own number
    p_of = {
        key: p
        for counts in (True, False)
        for key, p in _together({_key(c): c.p for c in found if c.kind.judged == counts}, settings).items()
    }
    drift_of = _together({_key(c): _order_p(c) for c in found if c.kind.judged}, settings)
    changes = []
    for change in found:
        p, drift = p_of.get(_key(change)), drift_of.get(_key(change))
        n = 0 if change.difference is None else change.difference.before.n
        changes.append(
            replace(
                change,
                p_adjusted=p,
                differs=p is not None and p <= level and n >= LEAST_JUDGED,
                p_drift=drift,
                drifts=drift is not None and drift <= level,
            )
        )
    return tuple(changes)


def _key(change: Change) -> tuple[str, str]:
    return change.kind.name, change.end


def _order_p(change: Change) -> float | None:
    """Return how probable the order of a feature's values is; None where this drop is none of them."""
    return order_p(np.array([e.value for e in change.series], float)) if change.estimate.known else None


def _together(p: dict[tuple[str, str], float | None], settings: Settings) -> dict[tuple[str, str], float]:
    """Return probabilities corrected for their number, by name and end; those that are not known are left out."""
    known = {key: each for key, each in p.items() if each is not None}
    return dict(zip(known, corrected(list(known.values()), settings.compare.correction), strict=True))


def _least_probable_first(changes: Iterable[Change]) -> tuple[Change, ...]:
    return tuple(sorted(changes, key=lambda change: 1.0 if change.p is None else change.p))


def _untold(drop: Drop, changes: tuple[Change, ...], number: int) -> tuple[Change, ...]:
    """Return the judged features without a value in the drop and in all those before, given how many these are."""
    told = {(c.kind.name, c.end) for c in changes}
    lacking = {(f.name, f.end): f.estimate for f in drop.features if f.name in KINDS and (f.name, f.end) not in told}
    return tuple(
        _compared(key, lacking[key], [], (number,), 0.0)
        for key in in_order(lacking, drop.ends)
        if KINDS[key[0]].judged and not KINDS[key[0]].forces
    )


def _compared(
    key: tuple[str, str],
    estimate: Estimate | None,
    earlier: list[tuple[str, Estimate]],
    numbers: tuple[int, ...],
    level: float,
) -> Change:
    """Return one feature against the drops before, not yet corrected for the others."""
    kind, end = KINDS[key[0]], key[1]
    if estimate is None:
        estimate = Estimate.missing(kind.unit, NO_SUCH)
    difference, why = None, ""
    left_out: tuple[str, ...] = ()
    if estimate.value is None:
        why = estimate.why
    elif not earlier:
        why = "no matching drop before has it"
    else:
        values = np.array([e.value for _, e in earlier], float)
        sigmas = np.array([e.sigma or 0.0 for _, e in earlier])
        # of drops all at nought, this one has the only size
        usual = abs(float(np.median(values))) or abs(estimate.value)
        least = kind.least * (usual if kind.relative else 1.0)
        kept = baseline(values, least, level)
        left_out = tuple(drop for (drop, _), keep in zip(earlier, kept, strict=True) if not keep)
        difference = compare_value(estimate.value, estimate.sigma or 0.0, values[kept], sigmas[kept], least)
    return Change(
        kind, end, estimate, tuple(earlier), numbers, left_out, difference,
        p_adjusted=None, differs=False, p_drift=None, drifts=False, why=why,
    )  # fmt: skip
