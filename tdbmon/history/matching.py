"""Matching: a drop is compared with earlier drops of the same machine and assembly at about the same speed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import isinf

from tdbmon.history.catalogue import Entry, seconds
from tdbmon.history.settings import Settings
from tdbmon.history.speed_class import same_speed
from tdbmon.quantity import moment

# matched whole, as a check of the record without a channel: "machine and record NDE" is another check
_FOREIGN = "machine"
_STILL = "drop"
# inverted, swapped, duplicated or exchanged probes and those of a wrong scale; prefixes before the channel
_OF_PROBES = ("fall ", "whirl ", "identical ", "cabling ", "probe scales ")
# a single end may fail these in a healthy drop; both ends fail if all probes differ from the machine file
_OF_ALL_PROBES = ("free fall ", "rest at the bottom ")

_DAY_S = 86400.0


@dataclass(frozen=True)
class Conditions:
    """Conditions for matching the drop compared.

    Attributes
    ----------
    machine, assembly : str
    speed : float
        At the release, Hz.
    tolerance : float
        Relative difference up to which speeds count as the same.
    before : tuple
        `Entry.order` of the drop compared.
    """

    machine: str
    assembly: str
    speed: float | None
    tolerance: float
    before: tuple[float, str, str]

    def fits(self, entry: Entry) -> bool:
        """Return whether an entry is an earlier drop that meets these conditions."""
        if entry.machine != self.machine or entry.assembly != self.assembly or entry.order >= self.before:
            return False
        if self.speed is None or entry.speed is None:
            return self.speed is None and entry.speed is None
        return same_speed(entry.speed, self.speed, self.tolerance)


def counts(entry: Entry) -> bool:
    """Return whether an entry counts as a drop of its machine: not if its record names another machine or holds no drop."""
    return not {_FOREIGN, _STILL} & set(entry.failed_checks)


def doubts(failed_checks: Iterable[str]) -> tuple[str, ...]:
    """Return those of a record's failed checks (name and channel) that make its displacements doubtful for its machine."""
    failed = tuple(failed_checks)
    of_probes = doubted_probes(failed)
    return tuple(each for each in failed if each in (_FOREIGN, _STILL) or each in of_probes)


def doubted_probes(failed_checks: Iterable[str]) -> tuple[str, ...]:
    """Return the doubts that concern probes, not the record as a whole."""
    failed = tuple(failed_checks)
    at_both = tuple(name for name in _OF_ALL_PROBES if sum(each.startswith(name) for each in failed) > 1)
    return tuple(each for each in failed if each.startswith(_OF_PROBES + at_both))


def conditions(entry: Entry, settings: Settings) -> Conditions:
    """Return the conditions for matching a drop."""
    return Conditions(entry.machine, entry.assembly, entry.speed, settings.matching.speed, entry.order)


def clock_remarks(entry: Entry, others: list[Entry]) -> list[str]:
    """Return remarks on the time of a drop: not stated, in the future, or before that of drops filed earlier."""
    if not entry.dropped:
        place = "earlier than all drops with a time, in the order of filing" if isinf(entry.moment) else "dropped now"
        return [
            f"the record states no readable time of the drop: it counts as {place}; file it with --dropped TIME"
            f"{' after removing it' if isinf(entry.moment) else ''}"
        ]
    found = []
    if _ahead(entry):
        found.append(
            f"the time of the drop, {entry.dropped}, is after its filing ({moment(entry.filed)}): the recorder's clock is wrong"
        )
    later = [
        e for e in others if e.id != entry.id and e.dropped and e.moment > entry.moment and _filed_before(e, entry)
    ]
    if later:
        found.append(
            f"the time of the drop, {entry.dropped}, is before that of {len(later)} drop{'s' if len(later) > 1 else ''}"
            f" filed earlier (the last: {later[-1].dropped}): it was filed late, or the recorder's clock was set back;"
            " if it was set back, remove the drop and file it with --dropped"
        )
    return found


def odd_clocks(entries: Sequence[Entry]) -> set[str]:
    """Return the drops, of all drops of a machine in order, on whose stated time `clock_remarks` has a remark.

    One pass backwards: a drop was filed late if any later drop was filed before it, hence if the first filed of these was.
    """
    odd: set[str] = set()
    first: Entry | None = None  # first filed of the later drops
    stated = [entry for entry in entries if entry.dropped and seconds(entry.filed) is not None]
    for _, of_moment in groupby(reversed(stated), key=lambda entry: entry.moment):
        at_once = list(of_moment)
        odd |= {e.id for e in at_once if _ahead(e) or (first is not None and _filed_before(first, e))}
        first = min([*at_once, *([] if first is None else [first])], key=lambda entry: seconds(entry.filed) or 0.0)
    return odd


def assembly_remarks(entry: Entry, others: list[Entry]) -> list[str]:
    """Return a remark if a drop states no assembly but earlier ones do."""
    words = [e.assembly for e in others if e.assembly and e.order < entry.order]
    if entry.assembly or not words:
        return []
    return [
        f"no assembly is stated for this drop, but '{words[-1]}' for drops before it: it is compared with drops without a"
        " stated assembly; if it is of that assembly, remove it and file it with --assembly"
    ]


def speed_remarks(entry: Entry, others: list[Entry], why: str) -> list[str]:
    """Return a remark with the reason if a drop's speed is unknown but that of earlier ones is known."""
    known = [e for e in others if e.speed is not None and e.assembly == entry.assembly and e.order < entry.order]
    if entry.speed is not None or not known:
        return []
    return [
        f"the speed at the release is not known{f' ({why})' * bool(why)}, so it is compared with none of the {len(known)} drops"
        " before with a speed: tdbmon analyse shows what is wrong with the record, its speed signal or its keyphasor"
    ]


def _ahead(entry: Entry) -> bool:
    """Return whether a drop states a time after its filing."""
    filed = seconds(entry.filed)
    return filed is not None and entry.moment > filed + _DAY_S


def _filed_before(one: Entry, other: Entry) -> bool:
    """Return whether a drop was filed on an earlier day than another; within a day a folder is filed in any order."""
    first, second = seconds(one.filed), seconds(other.filed)
    return first is not None and second is not None and second - first > _DAY_S
