"""All drops of one machine: each against those before it, and the trends over all of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

from tdbmon.estimate import Estimate
from tdbmon.history import catalogue
from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.feature import KINDS
from tdbmon.history.mixed_trend import mixed_trend
from tdbmon.history.speed_class import speed_classes
from tdbmon.history.standing import Judged, judge, standing

_MOST = 40  # of the latest drops are judged one by one


@dataclass(frozen=True)
class Course:
    """A feature over all drops of the machine.

    Attributes
    ----------
    name, end : str
    values : tuple of (Entry, Estimate)
        In order; those that are known.
    slope : Estimate
        A drop, over all speeds.
    """

    name: str
    end: str
    values: tuple[tuple[Entry, Estimate], ...]
    slope: Estimate


@dataclass(frozen=True)
class MachineHistory:
    """A machine over its drops.

    Attributes
    ----------
    machine : str
    entries : tuple of Entry
    classes : tuple of int
        Class of speed of each.
    judged : tuple of Judged
        The latest drops, each against those before it.
    standing : tuple of Judged
        The alarms that stand, of whatever drop, the worst first.
    courses : tuple of Course
    """

    machine: str
    entries: tuple[Entry, ...]
    classes: tuple[int, ...]
    judged: tuple[Judged, ...]
    standing: tuple[Judged, ...]
    courses: tuple[Course, ...]

    @property
    def flagged(self) -> dict[tuple[str, str], tuple[str, ...]]:
        """By feature and end, the identifiers of the drops in which it was flagged."""
        found: dict[tuple[str, str], tuple[str, ...]] = {}
        for judged in self.judged:
            for change in judged.comparison.flagged:
                key = (change.kind.name, change.end)
                found[key] = (*found.get(key, ()), judged.comparison.entry.id)
        return found

    @property
    def last(self) -> Judged:
        """The latest drop."""
        return self.judged[-1]


def machine_history(archive: Archive, machine: str, progress: Callable[[str], None] = lambda _: None) -> MachineHistory:
    """Return the history of a machine (raises `InputError` where the archive has no drops of it)."""
    entries = archive.entries(machine)
    settings = archive.settings(machine)
    with catalogue.reading(archive.catalogue) as base:
        features = catalogue.features(base, [e.result for e in entries])
    of_drop = cache(partial(judge, archive))
    judged = []
    for i, entry in enumerate(entries[-_MOST:], start=1):
        progress(f"comparing drop {i} of {min(len(entries), _MOST)}")
        judged.append(of_drop(entry.id))
    stand = standing(entries, of_drop)
    classes = speed_classes([e.speed for e in entries], settings.matching.speed)
    ends = sorted({f.end for e in entries for f in features[e.result]})
    courses = []
    for name, kind in KINDS.items():
        for end in ends:
            series = [
                next((f.estimate for f in features[e.result] if (f.name, f.end) == (name, end)), None) for e in entries
            ]
            known = [(e, s) for e, s in zip(entries, series, strict=True) if s is not None and s.known]
            if not kind.judged or not known:
                continue
            missing = Estimate.missing(kind.unit, "not filed")
            slope = mixed_trend([s or missing for s in series], list(range(len(entries))), classes, kind.unit)
            courses.append(Course(name, end, tuple(known), slope))
    return MachineHistory(machine, tuple(entries), tuple(classes), tuple(judged), stand, tuple(courses))
