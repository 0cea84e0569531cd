"""The verdict on a drop, with its reasons: as before, changed, inspect before the next start, too few drops, or no drop."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Literal

from tdbmon.estimate import Estimate
from tdbmon.history.compare import Change, Comparison
from tdbmon.history.difference import LEAST_JUDGED
from tdbmon.history.matching import doubted_probes
from tdbmon.quantity import counted, percent, stated_percent, words

Word = Literal["as before", "changed", "inspect", "too few drops", "no drop"]

ALARMS: tuple[Word, ...] = ("inspect", "changed", "no drop")  # the worst first
WORST_FIRST: tuple[Word, ...] = (*ALARMS, "too few drops", "as before")
_SUSPICIOUS = 0.4  # of all quantities: wear changes a few
_BLIND = 0.5  # of the quantities of earlier drops: who tells less is not known to be as before


@dataclass(frozen=True)
class Verdict:
    """What to do.

    Attributes
    ----------
    word : str
    reasons : tuple of str
        Plain sentences.
    """

    word: Word
    reasons: tuple[str, ...]

    @property
    def alarm(self) -> bool:
        """True for anything but "as before" and "too few drops": `--fail-on alarm` fails on it."""
        return self.word in ALARMS


def verdict_of(comparison: Comparison) -> Verdict:
    """Judge a comparison by the settings of its archive."""
    if comparison.no_drop:
        return Verdict("no drop", (*_no_drop(comparison), *comparison.remarks))
    inspect = [*_limits(comparison), *_life(comparison), *_blind(comparison), *_doubted(comparison)]
    changed = [_sentence(change, comparison) for change in comparison.flagged]
    if comparison.likeness.strange:
        changed.insert(0, comparison.likeness.sentence)
    elif len(changed) > _SUSPICIOUS * comparison.tested:
        changed.append(
            f"{len(changed)} of {comparison.tested} quantities differ at once: make sure that this is a drop of this machine,"
            " with the same probes and assembly"
        )
    least = comparison.settings.compare.least_drops
    n = len(comparison.matched)
    few = []
    if n < least:
        few.append(
            f"{counted(n, 'matching drop')} before; “as before” takes {least}: with so few there is no control"
            " chart, only gross changes stand out, and what is usual for this machine is not known yet"
        )
    elif comparison.telling == 0:
        few.append(f"no quantity is known of this drop and of {LEAST_JUDGED} drops before: with fewer none stands out")
    remarks = [*beside(comparison), *comparison.remarks]
    if inspect:
        return Verdict("inspect", tuple(inspect + changed + few + remarks))
    if changed:
        return Verdict("changed", tuple(changed + remarks))
    if few:
        return Verdict("too few drops", tuple(few + remarks))
    all_well = (
        f"none of {comparison.telling} quantities differs from the {n} matching drops before by more than chance"
        f" (all together {stated_percent(comparison.settings.compare.significance)})"
    )
    if comparison.silent:
        all_well += (
            f"; nothing is told by {comparison.silent} more, of which fewer than {LEAST_JUDGED} of these have a value"
        )
    return Verdict("as before", (all_well, *remarks))


def beside(comparison: Comparison) -> list[str]:
    """Say what differs by more than chance and is no matter of the fall (levitation, speed), and what drifts unflagged."""
    said = [_sentence(change, comparison) for change in comparison.noted]
    said += [_drift(change, comparison) for change in comparison.drifting]
    return [f"beside the verdict: {each}" for each in said]


def _drift(change: Change, comparison: Comparison) -> str:
    trend = change.trend
    if trend is None or trend.slope.value is None or change.p_drift is None:
        raise ValueError(f"{change.title}: drifts without a trend")
    way, slope = "rises", trend.slope
    if trend.slope.value < 0:
        low, high = (None if end is None else -end for end in (slope.high, slope.low))
        way, slope = "falls", replace(slope, value=-trend.slope.value, low=low, high=high)
    return (
        f"{change.title}: {way} from drop to drop, by {words(slope)} each over {len(change.series)} drops"
        f" (p = {change.p_drift:.2g}, corrected), so that no drop stands out from those before it; may come from:"
        f" {_causes(change, comparison)}"
    )


def _no_drop(comparison: Comparison) -> list[str]:
    """Say that the record tells nothing of the bearings, and why."""
    said = f"no drop in this record, so that it does not count: {comparison.no_drop}"
    return [said, comparison.foreign] if comparison.foreign else [said]


def _limits(comparison: Comparison) -> list[str]:
    """Limits of the settings that the drop passes."""
    limits, found = comparison.settings.inspect, []
    for change in comparison.changes:
        value = change.estimate.value
        if value is None:
            continue
        if change.kind.name == "gap_um" and change.grown is not None and change.grown > limits.gap_growth:
            found.append(
                f"{change.end}: the radius at rest has grown by {percent(change.grown, 1)}, more than"
                f" {stated_percent(limits.gap_growth)}"
            )
        if change.kind.name == "stress_max_mpa" and value > limits.stress:
            found.append(
                f"{change.end}: Hertz stress of {value * 1e-6:.0f} MPa, above the limit of {limits.stress * 1e-6:.0f} MPa"
            )
        if change.kind.name == "whirl_backward_s" and value > limits.backward_whirl:
            found.append(f"{change.end}: backward whirl for {value:.3g} s, longer than {limits.backward_whirl:.3g} s")
    return found


def _blind(comparison: Comparison) -> list[str]:
    """Say where most of what the earlier drops tell is missing of this one, or all of an end: "as before" would be a guess."""
    least = comparison.settings.compare.least_drops
    told = [
        change
        for change in comparison.changes
        if change.kind.judged and not change.kind.forces and sum(known.known for _, known in change.earlier) >= least
    ]
    seen = {change.end for change in told if change.estimate.known}
    lost = [change for change in told if not change.estimate.known]
    known = len(told) - len(lost)
    unseen = [change for change in lost if change.end and change.end not in seen]
    if known < _BLIND * len(told):
        said = f"this drop tells only {known} of {len(told)} quantities that earlier drops tell"
    elif unseen:
        ends = " and ".join(dict.fromkeys(change.end for change in unseen))
        said = f"this drop tells none of the {len(unseen)} quantities that earlier drops tell of {ends}"
        lost = unseen
    else:
        return []
    failed = comparison.entry.failed_checks
    if failed:
        return [
            f"{said}; its record failed {counted(len(failed), 'check')}: {', '.join(failed)}: see to the probes before the"
            " next drop"
        ]
    ((why, _),) = Counter(change.estimate.why for change in lost).most_common(1)
    return [
        f"{said}, so that it does not show whether the bearings are as before; no check of its record failed, most is missing"
        f" since {why}"
    ]


def _doubted(comparison: Comparison) -> list[str]:
    """Say that the record or its probes do not show this machine: what differs may be theirs."""
    failed = doubted_probes(comparison.entry.failed_checks)
    found = [f"{comparison.foreign}; what differs may be that machine's"] if comparison.foreign else []
    if failed:
        found.append(
            f"checks of the record's probes failed ({', '.join(failed)}): what differs may be theirs; see to their cables"
        )
    return found


def _life(comparison: Comparison) -> list[str]:
    life = comparison.life
    if life.agreed is None or life.margin.value is None or life.margin.value > 0:
        return []
    return [
        f"{life.full_drops} full drops of {life.agreed} agreed"
        + (f", as much as {life.damage.value:.1f} drops like the first" if life.damage.value is not None else "")
        + ": the agreed number is used up"
    ]


def _sentence(change: Change, comparison: Comparison) -> str:
    difference = change.difference
    if difference is None or change.p_adjusted is None:
        raise ValueError(f"{change.title}: off without a difference")
    low, high = difference.low, difference.high
    size = abs(difference.value)
    if low is not None and high is not None:
        low, high = (low, high) if difference.value > 0 else (-high, -low)
    value = words(Estimate(size, low, high, change.kind.unit))
    way = "above" if difference.value > 0 else "below"
    n = difference.before.n
    since = comparison.record(change.since)
    some = f"{n} of the {len(change.earlier)}" if change.left_out and not since else f"the {n}"
    began = f" {since}, where the change began" if since else ""
    return (
        f"{change.title}: {value} {way} {some} matching drops before{began}"
        f" (p = {change.p_adjusted:.2g}, corrected); may come from: {_causes(change, comparison)}"
    )


def _causes(change: Change, comparison: Comparison) -> str:
    """Return what a change may come from; first from the other end where only that can have made a restitution above one."""
    others = " or ".join(sorted({c.end for c in comparison.changes} - {"", change.end}))
    if not change.kind.both_ends or not others:
        return change.kind.meaning
    restitution = next(
        (c.estimate.value for c in comparison.changes if (c.kind.name, c.end) == ("restitution", change.end)), None
    )
    if restitution is not None and restitution > 1:
        return (
            f"the other end, {others}: the restitution here is {restitution:.2f}, and above 1 the impact there feeds it (gap,"
            f" wear of journal or inner ring); or {change.kind.meaning}"
        )
    return f"{change.kind.meaning}; or the other end, {others}, whose impact feeds it or takes from it"
