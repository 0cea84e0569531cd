"""What has changed since earlier drops of the machine.

The earlier drops, the reference, are diagnosed first.  Causes named there, or the likeliest of an ambiguous set, stand in the
plain model of the later drops, so that a cause named then is new.  Values of the machine that moved between the two fits within
their tolerances are listed too, such as a worn clearance or a risen friction.  A value far beyond its tolerance looks like a
wrong entry of the machine file; but if the earlier drops fit the file, the machine has changed, and the later drops are diagnosed
once more with the value that fits them.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import xarray as xr
from tdbsim.effect import Effect
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.diagnosis.contender import EXPLAINED
from tdbmon.diagnosis.diagnose import Diagnosis, diagnose
from tdbmon.diagnosis.next_test import CHANGED
from tdbmon.diagnosis.verdict import Kind, Verdict, outside
from tdbmon.estimate import Estimate
from tdbmon.identify.measured_drops import check_names
from tdbmon.identify.parameters import entries, machine_parameters, restated_machine
from tdbmon.machine_file import with_effects
from tdbmon.progress import Progress
from tdbmon.quantity import short, words
from tdbmon.record.assign import assign
from tdbmon.record.same_samples import same_samples

Values = Mapping[str, Estimate]

APART = 3.0  # combined half widths of the intervals beyond which a value has changed; the intervals are too narrow
# least change that is listed, in standard deviations of the prior, each half of a tolerance: intervals are too narrow
LEAST = 1.0
CLEARANCE_LEAST = 2.0  # the same for a ball clearance, which drops determine worst
_SMALLEST = 0.25  # share of the least change above which a remark is made; fits of one condition differ by less
_COMPENSATED = 0.5  # share of the greater of two changes below which their sum counts as compensated


@dataclass(frozen=True)
class Change:
    """A value of the machine in the earlier and in the later drops.

    Attributes
    ----------
    name : str
        Such as ``"DE.friction"``.
    before, since : Estimate
    """

    name: str
    before: Estimate
    since: Estimate


@dataclass(frozen=True, eq=False)
class Reference:
    """The earlier drops, and the changes since.

    Attributes
    ----------
    before : Diagnosis
        Of the earlier drops alone.
    changes : tuple of Change
        Those beyond their tolerance first, then by size in units of their intervals.
    remarks : tuple of str
        Faults of the earlier drops, what they leave open, and differences too small to count as changes.
    not_compared : str
        Which values could not be compared, and why; empty if all were.
    compares : bool
        False if none could be, since a fit does not follow its drops or the machine file states no tolerance.
    """

    before: Diagnosis
    changes: tuple[Change, ...]
    remarks: tuple[str, ...]
    not_compared: str = ""
    compares: bool = True


def diagnose_since(
    machine: Machine,
    reference: Sequence[xr.Dataset],
    records: Sequence[xr.Dataset],
    progress: Progress,
    workers: int = 1,
) -> tuple[Diagnosis, Reference]:
    """Diagnose drops against earlier ones of the same machine.

    Parameters
    ----------
    machine : Machine
    reference, records : sequence of Dataset
        Earlier drops, in one condition, and the later ones, as from `tdbmon.record.read.read`.
    progress : callable
        Called with the name of each step as it begins.
    workers : int
        Processes that take part.

    Returns
    -------
    Diagnosis
        Of the later drops: its causes are new.
    Reference

    Raises
    ------
    InputError
        If a record is in both, some name another machine and others do not, or a diagnosis is impossible.
    """
    check_names([*reference, *records], machine)
    # by content: folders of different years often hold the same names, and one drop has many formats
    earlier = [assign(each, machine) for each in reference]
    for record in records:
        laid = assign(record, machine)
        if any(same_samples(laid, each) for each in earlier):
            raise InputError(
                f"{record.attrs.get('source_file', 'record')} is given as reference and as record; give each drop once"
            )
    before = diagnose(machine, reference, lambda step: progress(f"reference: {step}"), workers)
    later = with_effects(machine, standing(before))
    since = diagnose(later, records, progress, workers)
    wanted = since.wanted if follows(before) else {}
    if wanted:
        since = beside(wanted, diagnose(restated_machine(later, wanted), records, progress, workers))
    return since, compared(machine, before, since, wanted)


def follows(diagnosis: Diagnosis) -> bool:
    """True if the fit follows its drops; else its values say nothing of the machine."""
    return diagnosis.verdict.kind is not Kind.UNKNOWN or diagnosis.plain.ratio <= EXPLAINED


def beside(wanted: Collection[str], since: Diagnosis) -> Diagnosis:
    """Return the diagnosis of the later drops, made with changed values in the model, with these in its verdict.

    If nothing else is missing the verdict is unknown all the same: the change exceeds the tolerances, and no effect of the
    catalogue stands for it.
    """
    names, verdict = " and ".join(wanted), since.verdict
    if verdict.kind is not Kind.NONE:
        return replace(
            since, verdict=replace(verdict, why=f"{verdict.why}, with {names} as changed since the reference drops")
        )
    why = (
        f"since the reference drops, which fit the machine file, {names} changed beyond what it allows; with that change"
        f" {verdict.why}"
    )
    return replace(since, verdict=outside(verdict, why), changed=names, next_test=CHANGED)


def compared(machine: Machine, before: Diagnosis, since: Diagnosis, wanted: Mapping[str, float]) -> Reference:
    """Return the changes between two diagnoses of a machine.

    Parameters
    ----------
    machine : Machine
        As in its file.
    before, since : Diagnosis
    wanted : mapping of float
        Values (SI, by name) that have changed beyond their tolerances, by the first contacts of the later drops.
    """
    jumps, remarks = tuple(_jumps(machine, before, since, wanted)), (*_of_records(before), *_remarks(before))
    lost = {"reference": before, "later": since}
    lost = {which: each for which, each in lost.items() if not follows(each)}
    if lost:
        left = " and ".join(
            f"{each.plain.times_noise} times that of noise alone in the {which} drops" for which, each in lost.items()
        )
        other = "other values" if jumps else "values of the machine"
        why = f"{other}: the misfit is {left}, and a fit that does not follow the drops does not determine values"
        return Reference(before, jumps, remarks, why, compares=False)
    if not machine_parameters(machine):
        why = "values of the machine: its file states no tolerances, so none was fitted; state how well they are known"
        return Reference(before, jumps, remarks, why, compares=False)
    fits = machine, before.values, since.values
    told = (*jumps, *(each for each in changes(*fits) if each.name not in wanted))
    return Reference(before, told, (*remarks, *smaller(*fits, wanted)), _edges(*fits, wanted))


def standing(before: Diagnosis) -> list[Effect]:
    """Return the causes of the first accused model of the earlier drops, at their fitted values; nothing without one.

    Causes with an angle or a number of their own in every drop are left out, since the later drops have others.
    """
    if not before.verdict.accused:
        return []
    best = before.verdict.accused[0]
    shared, own = best.problem.values(best.fit.point, 0)
    return [each.at(shared, own, 0) for each in best.problem.free if not each.of_each_drop]


def _of_records(before: Diagnosis) -> tuple[str, ...]:
    """Return the remarks on the reference drops; those that name no drop say that they concern the reference."""
    names = tuple(f"{drop.name}: " for drop in before.plain.problem.drops)
    return tuple(each if each.startswith(names) else f"of the reference drops: {each}" for each in before.remarks)


def _remarks(before: Diagnosis) -> tuple[str, ...]:
    verdict = before.verdict
    if verdict.kind is Kind.UNKNOWN:
        return (f"the reference drops are not explained (unknown: {verdict.why}): the later ones may not be either",)
    if not verdict.accused:
        return ()
    turning = [
        (
            f.name,
            "with a number that differs from drop to drop"
            if f.each_held
            else "at an angle that differs from drop to drop",
        )
        for f in verdict.accused[0].problem.free
        if f.of_each_drop
    ]
    return tuple(_left_open(verdict)) + tuple(
        f"{name} is already in the reference drops, {otherwise}: if it is named again, it is not new"
        for name, otherwise in turning
    )


def _left_open(verdict: Verdict) -> Iterator[str]:
    """Say which of several causes stands in the model of the later drops, if the earlier ones leave that open."""
    first, *others = dict.fromkeys(each.words for each in verdict.accused)
    others += [each.words for each in verdict.alike]
    if verdict.or_nothing:
        others.append("nothing at all")
    if others:
        yield (
            f"the reference drops leave open whether they show {first}, which the model of the later drops includes, or"
            f" {' or '.join(others)}: a cause that is named in addition may not be new"
        )


def changes(machine: Machine, before: Values, since: Values) -> tuple[Change, ...]:
    """Return the values of the machine that changed between two fits by more than their intervals and the least change listed.

    Parameters
    ----------
    machine : Machine
        Its tolerances determine the least change.
    before, since : mapping of Estimate
        As from `tdbmon.diagnosis.sizes.sizes_of`.
    """
    return tuple(change for change, size, least in _moved(machine, before, since) if size > least)


def smaller(machine: Machine, before: Values, since: Values, changed: Collection[str] = ()) -> tuple[str, ...]:
    """Return remarks on values that differ by more than their intervals but less than the least change, `changed` left out."""
    return tuple(
        f"{change.name} differs too, {words(change.before)} before and {words(change.since)} since, by"
        f" {short(Estimate(size, unit=change.before.unit))}: no change is reported below"
        f" {short(Estimate(least, unit=change.before.unit))}, a limit set by its tolerance in the machine file, since intervals"
        " of fits are too narrow; state a narrower tolerance if the value is known better"
        for change, size, least in _moved(machine, before, since)
        if _SMALLEST * least < size <= least and change.name not in changed
    )


def _moved(machine: Machine, before: Values, since: Values) -> list[tuple[Change, float, float]]:
    """Return the values that differ by more than their intervals, with the difference and the least change that is listed."""
    found = []
    for own in machine_parameters(machine):
        pair = before[own.name], since[own.name]
        (x, half), (y, other) = map(_value_and_half_width, pair)
        apart = abs(y - x) / max(math.hypot(half, other), 1e-300)
        inside = not any(own.at_bound(value) for value in (x, y))  # a value at its bound has no interval
        least = CLEARANCE_LEAST if own.name.endswith(".diametral_clearance") else LEAST
        if inside and apart > APART and not _compensated(own.name, before, since):
            found.append((apart, (Change(own.name, *pair), abs(y - x), least * own.scale)))
    return [each for _, each in sorted(found, key=lambda each: -each[0])]


def _compensated(name: str, before: Values, since: Values) -> bool:
    """True for a gap or a ball clearance whose change the other compensates for: drops determine their sum."""
    end, _, field = name.rpartition(".")
    pair = (f"{end}.radial_gap", 1.0), (f"{end}.diametral_clearance", 0.5)
    if field not in ("radial_gap", "diametral_clearance") or any(each not in before for each, _ in pair):
        return False
    parts = [share * ((since[each].value or 0.0) - (before[each].value or 0.0)) for each, share in pair]
    return abs(sum(parts)) < _COMPENSATED * max(map(abs, parts))


def _jumps(machine: Machine, before: Diagnosis, since: Diagnosis, wanted: Mapping[str, float]) -> Iterator[Change]:
    for own in (each for each in entries(machine) if each.name in wanted):
        stated = Estimate(own.nominal, unit=own.unit, why="stated without tolerance; the reference drops fit it")
        found = Estimate(wanted[own.name], unit=own.unit, why="no interval: estimated from the first contacts")
        fitted = since.values if follows(since) else {}
        yield Change(own.name, before.values.get(own.name, stated), fitted.get(own.name, found))


def _edges(machine: Machine, before: Values, since: Values, changed: Collection[str] = ()) -> str:
    """Say which values ran to the edge of their tolerance in either fit, `changed` left out."""
    found = []
    for own in (each for each in machine_parameters(machine) if each.name not in changed):
        fits = {"reference": before[own.name], "later": since[own.name]}
        at = [which for which, each in fits.items() if each.value is not None and own.at_bound(each.value)]
        if at:
            found.append(f"{own.name} ({' and '.join(at)} drops)")
    if not found:
        return ""
    return (
        f"{', '.join(found)}: the fit reached the limit of the tolerance in the machine file; a wider tolerance would show"
        " whether the value has changed"
    )


def _value_and_half_width(estimate: Estimate) -> tuple[float, float]:
    if estimate.value is None or estimate.high is None:
        return math.nan, math.inf
    return estimate.value, estimate.high - estimate.value
