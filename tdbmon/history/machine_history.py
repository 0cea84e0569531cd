"""All drops of one machine: each compared with the earlier ones, and the trends over all."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial

from tdbmon.estimate import Estimate
from tdbmon.history import catalogue
from tdbmon.history.archive import Archive
from tdbmon.history.catalogue import Entry
from tdbmon.history.common_slope import common_slope
from tdbmon.history.common_step import common_step
from tdbmon.history.feature import KINDS, Feature, Key, in_order
from tdbmon.history.matching import doubts
from tdbmon.history.speed_class import speed_classes
from tdbmon.history.standing import Judged, judge, standing
from tdbmon.progress import Progress, silent

_MOST = 40  # latest drops that are judged one by one


@dataclass(frozen=True)
class Course:
    """A feature over all drops of the machine whose records show it (see `tdbmon.history.matching.doubts`).

    Attributes
    ----------
    name, end : str
    values : tuple of (Entry, Estimate)
        Known values, in order.
    slope : Estimate
        Per drop, common to all speeds and assemblies; missing if a step describes them better.
    step : Entry or None
        The first drop after that step.
    rise : Estimate
        Rise of the levels at the step.
    step_p : float or None
        p-value of the step.
    """

    name: str
    end: str
    values: tuple[tuple[Entry, Estimate], ...]
    slope: Estimate
    step: Entry | None
    rise: Estimate
    step_p: float | None

    @property
    def key(self) -> Key:
        """Name and end."""
        return self.name, self.end

    @property
    def title(self) -> str:
        """Title with the end, for reports."""
        return KINDS[self.name].title_at(self.end)


@dataclass(frozen=True)
class MachineHistory:
    """A machine over its drops.

    Attributes
    ----------
    machine : str
    entries : tuple of Entry
    classes : tuple of int
        Speed class of each.
    judged : tuple of Judged
        The latest drops, each with its comparison.
    standing : tuple of Judged
        The standing alarms, of any drop, the worst first.
    courses : tuple of Course
    """

    machine: str
    entries: tuple[Entry, ...]
    classes: tuple[int, ...]
    judged: tuple[Judged, ...]
    standing: tuple[Judged, ...]
    courses: tuple[Course, ...]

    @property
    def flagged(self) -> dict[Key, tuple[str, ...]]:
        """Identifiers of the drops in which a feature was flagged, by name and end; drops with doubted records left out."""
        found: dict[Key, tuple[str, ...]] = {}
        for judged in self.judged:
            if doubts(judged.comparison.entry.failed_checks):
                continue  # the courses leave it out
            for change in judged.comparison.flagged:
                found[change.key] = (*found.get(change.key, ()), judged.comparison.entry.id)
        return found

    @property
    def standing_earlier(self) -> tuple[Judged, ...]:
        """The standing alarms of drops before the latest."""
        return tuple(each for each in self.standing if each is not self.last)

    @property
    def last(self) -> Judged:
        """The latest drop."""
        return self.judged[-1]


def machine_history(archive: Archive, machine: str, progress: Progress = silent) -> MachineHistory:
    """Return the history of a machine (raises `InputError` if the archive has no drops of it)."""
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
    courses = _courses(entries, classes, [features[e.result] for e in entries], archive.ends(entries[-1].id))
    return MachineHistory(machine, tuple(entries), tuple(classes), tuple(judged), stand, tuple(courses))


def _courses(
    entries: list[Entry], classes: list[int], features: list[tuple[Feature, ...]], ends: tuple[str, ...]
) -> list[Course]:
    levels = [(number, entry.assembly) for number, entry in zip(classes, entries, strict=True)]
    drops: list[dict[Key, Estimate]] = [
        {} if doubts(entry.failed_checks) else {f.key: f.estimate for f in found if f.estimate.known}
        for entry, found in zip(entries, features, strict=True)
    ]
    courses = []
    for name, end in in_order({key for drop in drops for key in drop if key[0] in KINDS}, ends):
        kind = KINDS[name]
        if not kind.judged:
            continue
        series = [drop.get((name, end), Estimate.missing(kind.unit, "not known")) for drop in drops]
        known = tuple((entry, each) for entry, each in zip(entries, series, strict=True) if each.known)
        courses.append(_course(name, end, known, series, entries, levels))
    return courses


def _course(
    name: str,
    end: str,
    known: tuple[tuple[Entry, Estimate], ...],
    series: list[Estimate],
    entries: list[Entry],
    levels: list[tuple[int, str]],
) -> Course:
    """Return one feature's course with its common slope, or with a common step if that describes it better."""
    unit, order = KINDS[name].unit, range(len(entries))
    step = common_step(series, order, levels, unit)
    if step is None:
        no_step = Estimate.missing(unit, "no step is visible, or a slope describes the drops better")
        return Course(name, end, known, common_slope(series, order, levels, unit), None, no_step, None)
    first = entries[step.number]
    no_slope = Estimate.missing(unit, f"a step from {first.raw_name} on describes the drops better than a slope")
    return Course(name, end, known, no_slope, first, step.size, step.p)
