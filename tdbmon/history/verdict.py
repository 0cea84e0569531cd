"""The verdict on a drop, with its reasons: as before, changed, inspect before the next start, too few drops, or no drop."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from tdbmon.estimate import Estimate
from tdbmon.history.change import NO_SUCH, Change
from tdbmon.history.compare import Comparison
from tdbmon.history.difference import LEAST_JUDGED
from tdbmon.history.feature import NO_FORCES, Key
from tdbmon.history.matching import doubted_probes
from tdbmon.history.not_compared import named
from tdbmon.history.sight import WEAR, Sight, sights
from tdbmon.quantity import counted, percent, short, stated_percent, words

Word = Literal["as before", "changed", "inspect", "too few drops", "no drop"]

ALARMS: tuple[Word, ...] = ("inspect", "changed", "no drop")  # the worst first
WORST_FIRST: tuple[Word, ...] = (*ALARMS, "too few drops", "as before")
_SUSPICIOUS = 0.4  # of all features: wear changes only a few
_NAMED = 4  # drops that were off alike named in a remark
_BLIND = 0.5  # of the features of earlier drops: a drop with fewer is not judged "as before"


@dataclass(frozen=True)
class Verdict:
    """Verdict on a drop.

    Attributes
    ----------
    word : str
    reasons : tuple of str
        Plain sentences.
    concerns : tuple of Key
        Features that an alarm concerns: only a drop that shows them clears it.
    """

    word: Word
    reasons: tuple[str, ...]
    concerns: tuple[Key, ...] = ()

    @property
    def alarm(self) -> bool:
        """True for anything but "as before" and "too few drops": `--fail-on alarm` fails on it."""
        return self.word in ALARMS


def verdict_of(comparison: Comparison) -> Verdict:
    """Judge a comparison by the settings of its archive."""
    if comparison.no_drop:
        return Verdict("no drop", (*_no_drop(comparison), *comparison.remarks))
    seen = sights(comparison)
    passed, unfollowed = _limits(comparison), _unfollowed(comparison)
    inspect = [
        *(said for _, said in passed),
        *_life(comparison),
        *_blind(comparison, [each for each in seen if each.lost]),
        *_fit_lost(unfollowed),
        *_doubted(comparison),
    ]
    changed = [_sentence(change, comparison) for change in comparison.flagged]
    if comparison.likeness.strange:
        changed.insert(0, comparison.likeness.sentence)
    elif len(changed) > _SUSPICIOUS * comparison.tested:
        changed.append(
            f"{len(changed)} of {comparison.tested} quantities differ at once: make sure that this is a drop of this machine,"
            " with the same probes and assembly"
        )
    few = _few(comparison, seen)
    remarks = [*beside(comparison), *comparison.remarks]
    concerns = (
        *(change.key for change, _ in passed),
        *(("gap_um", each.end) for each in seen if each.lost),
        *(change.key for change in (*_most_lost(comparison), *unfollowed)),
        *(change.key for change in comparison.flagged),
        *(comparison.likeness.where if comparison.likeness.strange else ()),
    )
    if inspect:
        return Verdict("inspect", tuple(inspect + changed + few + remarks), concerns)
    if changed:
        return Verdict("changed", tuple(changed + remarks), concerns)
    if few:
        return Verdict("too few drops", tuple(few + remarks))
    return Verdict("as before", (_all_well(comparison), *map(_seen, seen), *remarks))


def _few(comparison: Comparison, seen: Sequence[Sight]) -> list[str]:
    """Return the reasons why "as before" cannot be stated: too few earlier drops, or an end with too little sensitivity."""
    n, least = len(comparison.matched), comparison.settings.compare.least_drops
    if n < least:
        return [
            f"{counted(n, 'matching drop')} before; “as before” needs {least}: with so few there is no control"
            " chart, only gross changes are detected, and the usual scatter of this machine is not known yet"
        ]
    if comparison.telling == 0:
        return [f"no quantity is known for this drop and for {LEAST_JUDGED} drops before: with fewer no change is detected"]
    return [_dim(each) for each in seen if not each.enough and not each.lost]


def _all_well(comparison: Comparison) -> str:
    """Return a text on the number of features on which "as before" is based."""
    repeated = len(comparison.repeated)
    others = f"{comparison.telling - repeated} other" if repeated else f"{comparison.telling}"
    said = (
        f"none of {others} quantities differs from the {len(comparison.matched)} matching drops before by more than chance"
        f" (all together {stated_percent(comparison.settings.compare.significance)})"
    )
    if comparison.silent:
        said += (
            f"; not judged: {comparison.silent} more, for which fewer than {LEAST_JUDGED} of these drops have a value"
        )
    return said


def _seen(sight: Sight) -> str:
    """Return a text on the number of drops on which "as before" is based at an end, and on the detectable growth."""
    growth = "" if sight.growth is None else f"; growth of the radius by {sight.seen_from} or more would have been detected"
    slope = "the slope of " if sight.slope else ""
    return f"{sight.end}: compared with {slope}{sight.drops} drops before{growth}"


def _dim(sight: Sight) -> str:
    """Return the reason why "as before" is not justified at an end: too few earlier drops, or too little sensitivity to wear."""
    things = "radius at rest, fall and deepest excursion"
    if sight.drops < sight.least_drops:
        return (
            f"{sight.end}: only {things} show wear, and each of these could be compared with at most"
            f" {counted(sight.drops, 'drop')} before; “as before” needs {sight.least_drops}"
        )
    growth = "" if sight.growth is None else f", only by {sight.seen_from} or more"
    return (
        f"{sight.end}: growth of the radius by {stated_percent(sight.limit)} would not have been detected{growth}: {things} of"
        f" {counted(sight.drops, 'drop')} before scatter too much (or drift, if no radius is known), or"
        " those of this drop are too uncertain"
    )


def beside(comparison: Comparison) -> list[str]:
    """Return remarks on significant differences that are not judged (levitation, speed) or occurred before, and on drifts."""
    said = [_sentence(change, comparison) for change in comparison.noted]
    said += [_again(change, comparison) for change in comparison.repeated]
    said += [_drift(change, comparison) for change in comparison.drifting]
    return [f"beside the verdict: {each}" for each in said]


def _again(change: Change, comparison: Comparison) -> str:
    value, way = _off(change)
    records = [comparison.record(drop) for drop in change.as_in]
    more = f" and {len(records) - _NAMED} more" if len(records) > _NAMED else ""
    return (
        f"{change.title}: {value} {way} the usual value, as in {', '.join(records[-_NAMED:])}{more}, after which it came back:"
        " this occurs occasionally on this machine"
    )


def _drift(change: Change, comparison: Comparison) -> str:
    trend = change.trend
    if trend is None or trend.slope.value is None or change.p_drift is None:
        raise ValueError(f"{change.title}: drifts without a trend")
    clear = f"over {len(change.series)} drops (p = {change.p_drift:.2g}, corrected)"
    if trend.step is not None:
        first = comparison.record(comparison.drop_at(change, trend.step.index))
        rise = trend.step.after - trend.step.before
        size = short(Estimate(abs(rise), unit=change.kind.unit), 0.1 * abs(rise))
        return (
            f"{change.title}: {'higher' if rise > 0 else 'lower'} by {size} from {first} on, a step shown by the order of the"
            f" values {clear}; this drop alone does not differ from those before it; may come from:"
            f" {_causes(change, comparison, rise)}"
        )
    way, slope = "rises", trend.slope
    if trend.slope.value < 0:
        low, high = (None if end is None else -end for end in (slope.high, slope.low))
        way, slope = "falls", replace(slope, value=-trend.slope.value, low=low, high=high)
    return (
        f"{change.title}: {way} from drop to drop, by {words(slope)} each {clear}, so no single drop differs from those before"
        f" it; may come from: {_causes(change, comparison, trend.slope.value)}"
    )


def _no_drop(comparison: Comparison) -> list[str]:
    """Return the reason why the record holds no information on the bearings."""
    said = f"no drop in this record, so it does not count: {comparison.no_drop}"
    return [said, comparison.foreign] if comparison.foreign else [said]


def _limits(comparison: Comparison) -> list[tuple[Change, str]]:
    """Return the changes beyond alarm limits, with the excess in words."""
    limits = comparison.settings.inspect
    found: list[tuple[Change, str]] = []
    for change in comparison.changes:
        value = change.estimate.value
        if value is None:
            continue
        said = ""
        if change.kind.name == "gap_um" and change.grown is not None and change.grown > limits.gap_growth:
            said = f"the radius at rest has grown by {percent(change.grown, 1)}, more than {stated_percent(limits.gap_growth)}"
        if change.kind.name == "stress_max_mpa" and value > limits.stress:
            said = f"Hertz stress of {value * 1e-6:.0f} MPa, above the limit of {limits.stress * 1e-6:.0f} MPa"
        if change.kind.name == "whirl_backward_s" and value > limits.backward_whirl:
            said = f"backward whirl for {value:.3g} s, longer than {limits.backward_whirl:.3g} s"
        if said:
            found.append((change, f"{change.end}: {said}"))
    return found


def _blind(comparison: Comparison, unseen: list[Sight]) -> list[str]:
    """Return the reasons why "as before" is not justified if this drop lacks most features of the earlier ones, or an end's.

    Parameters
    ----------
    comparison : Comparison
    unseen : list of Sight
        Ends visible in earlier drops but not in this one.
    """
    told = _told_before(comparison)
    lost = _most_lost(comparison)
    found = []
    if lost:
        found.append(f"this drop shows only {len(told) - len(lost)} of {len(told)} quantities that earlier drops show")
    else:
        ends = [each.end for each in unseen]
        lost = [change for change in told if not change.estimate.known and change.end in ends]
    for each in unseen:
        missing = sorted((c for c in lost if c.end == each.end), key=lambda change: change.kind.name not in WEAR)
        drops = max(len(change.earlier) for change in each.told)
        found.append(f"this drop does not show {each.end}, but {drops} drops before do: missing are {named(missing)}")
    if not found:
        return []
    said = "; ".join(found)
    failed = comparison.entry.failed_checks
    held = [each.removeprefix("held ") for each in failed if each.startswith("held ")]
    if held and len(held) == len(failed):
        return [
            f"{said}: the magnetic bearing held {' and '.join(held)}, so nothing is seen there; the probes are sound"
        ]
    if failed:
        return [
            f"{said}; its record failed {counted(len(failed), 'check')}: {', '.join(failed)}: check the probes before the"
            " next drop"
        ]
    ((why, _),) = Counter(change.estimate.why for change in lost).most_common(1)
    return [
        f"{said}, so it does not show whether the bearings are as before; no check of its record failed; the reason for most"
        f" missing quantities: {why}"
    ]


def _told_before(comparison: Comparison) -> list[Change]:
    """Return the judged features that at least three earlier drops have, fitted ones aside."""
    return [c for c in comparison.changes if c.kind.judged and not c.kind.forces and len(c.earlier) >= LEAST_JUDGED]


def _most_lost(comparison: Comparison) -> list[Change]:
    """Return those of these features that the drop lacks, if it has fewer than half of them; else an empty list."""
    told = _told_before(comparison)
    lost = [change for change in told if not change.estimate.known]
    return lost if len(told) - len(lost) < _BLIND * len(told) else []


def _unfollowed(comparison: Comparison) -> list[Change]:
    """Return the forces of the ends at which the fitted model agrees with earlier drops but not with this one."""
    return [
        change
        for change in comparison.changes
        if change.kind.name == "peak_force_n"
        and not change.estimate.known
        and change.estimate.why not in (NO_FORCES, NO_SUCH)
        and len(change.earlier) >= LEAST_JUDGED
    ]


def _fit_lost(unfollowed: list[Change]) -> list[str]:
    """Return a reason if the model agrees with earlier drops but not with this one, which indicates a new effect."""
    if not unfollowed:
        return []
    ends = " and ".join(change.end for change in unfollowed)
    first = unfollowed[0]
    return [
        f"the fitted model gives no forces at {ends}, but did for {counted(len(first.earlier), 'drop')} before: the shaft moves"
        f" differently than before ({first.estimate.why}); search for the cause with tdbmon diagnose"
    ]


def _doubted(comparison: Comparison) -> list[str]:
    """Return remarks if the record names another machine or its probes are doubtful, so that differences may stem from that."""
    failed = doubted_probes(comparison.entry.failed_checks)
    found = [f"{comparison.foreign}; the differences may be due to that"] if comparison.foreign else []
    if failed:
        found.append(
            f"checks of the record's probes failed ({', '.join(failed)}): the differences may come from the probes; check"
            " their cables, sensitivities and directions"
        )
    return found


def _life(comparison: Comparison) -> list[str]:
    life = comparison.life
    if life.agreed is None or life.margin.value is None or life.margin.value > 0:
        return []
    return [
        f"{life.full_drops} full drops of {life.agreed} agreed"
        + (f", equivalent to {life.damage.value:.1f} drops like the first" if life.damage.value is not None else "")
        + ": the agreed number is used up"
    ]


def _sentence(change: Change, comparison: Comparison) -> str:
    difference = change.difference
    if difference is None or change.p_adjusted is None:
        raise ValueError(f"{change.title}: off without a difference")
    value, way = _off(change)
    n = difference.before.n
    since = comparison.record(change.since)
    some = f"{n} of the {len(change.earlier)}" if change.left_out and not since else f"the {n}"
    began = f" {since}, where the change began" if since else ""
    some = f"the slope of {some}" if difference.before.slope is not None else some
    return (
        f"{change.title}: {value} {way} {some} matching drops before{began}"
        f" (p = {change.p_adjusted:.2g}, corrected); may come from: {_causes(change, comparison, difference.value)}"
    )


def _off(change: Change) -> tuple[str, str]:
    """Return the size of a difference in words, and whether it lies above or below."""
    found = change.difference
    if found is None:
        raise ValueError(f"{change.title}: off without a difference")
    low, high = found.low, found.high
    if low is not None and high is not None:
        low, high = (low, high) if found.value > 0 else (-high, -low)
    return words(Estimate(abs(found.value), low, high, change.kind.unit)), "above" if found.value > 0 else "below"


def _causes(change: Change, comparison: Comparison, way: float) -> str:
    """Return the possible causes of a change, up or down by the sign of `way`.

    The other end comes first if a restitution exceeds one, which nothing else can cause.
    """
    meaning = change.kind.causes(way)
    others = " or ".join(sorted({c.end for c in comparison.changes} - {"", change.end}))
    if change.kind.carried and others:
        return (
            f"{meaning}; or a probe of the other end, {others}, since the centre at the bearing is extrapolated from the probes"
            " of both ends"
        )
    if not change.kind.both_ends or not others:
        return meaning
    restitution = next((c.estimate.value for c in comparison.changes if c.key == ("restitution", change.end)), None)
    if restitution is not None and restitution > 1:
        return (
            f"the other end, {others}: the restitution here is {restitution:.2f}, and above 1 the impact there adds energy (gap,"
            f" wear of journal or inner ring); or {meaning}"
        )
    return f"{meaning}; or the other end, {others}, whose impact adds or removes energy"
