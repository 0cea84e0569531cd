"""Terminal output of a comparison and of a fleet."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tdbmon.estimate import Estimate
from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.fleet import REASONS, Member
from tdbmon.history.not_compared import not_compared_sentences
from tdbmon.history.speed_class import STANDSTILL, stood
from tdbmon.history.standing import Judged
from tdbmon.quantity import counted, plain, printed, short, stated_percent, subtracted


def comparison_lines(judged: Judged, standing: Sequence[Judged] = ()) -> list[str]:
    """Return verdict, reasons, standing alarms of earlier drops, and differences as lines of text."""
    comparison, verdict = judged.comparison, judged.verdict
    entry, wanted = comparison.entry, comparison.conditions
    speed = "speed unknown" if wanted.speed is None else f"{wanted.speed:.4g} Hz ± {stated_percent(wanted.tolerance)}"
    speed = STANDSTILL if stood(wanted.speed) else speed
    assembly = f", assembly {wanted.assembly}" if wanted.assembly else ""
    n = len(comparison.matched)
    lines = [
        f"drop {entry.id} ({entry.raw_name}) of {entry.machine}",
        f"matching: {speed}{assembly}: {counted(n, 'drop')} before",
        f"verdict: {verdict.word}",
        *(f"  {reason}" for reason in verdict.reasons),
        *(line for each in standing for line in _standing_lines(each)),
        *not_compared_sentences(comparison),
    ]
    compared = [change for change in comparison.changes if change.difference is not None]
    if compared:
        lines += _table(compared, comparison)
    life = comparison.life
    agreed = "none agreed" if life.agreed is None else f"{life.agreed} agreed"
    lines.append(f"full drops: {life.full_drops} ({agreed}); margin {printed(life.margin)}")
    return [plain(line) for line in lines]


def fleet_lines(members: Sequence[Member]) -> list[str]:
    """Return a line for each machine, worst first: its standing verdict and the drop, with the reasons of an alarm."""
    lines = []
    for member in members:
        undated = f", {member.undated} without a time" if member.undated else ""
        lines.append(
            f"{member.machine}: {member.verdict.word}: {member.judged.name}; {counted(member.drops, 'drop')}{undated}"
        )
        for each in member.standing:
            lines += [f"  {each.name}: {each.verdict.word}: {reason}" for reason in each.verdict.reasons[:REASONS]]
    return [plain(line) for line in lines]


def difference_of(change: Change) -> Estimate:
    """Return the difference of a change as an estimate."""
    found = change.difference
    if found is None:
        return Estimate.missing(change.kind.unit, change.why)
    why = "" if found.low is not None else "one drop before"
    return Estimate(found.value, found.low, found.high, change.kind.unit, why=why)


def values_of(change: Change) -> tuple[str, str, str]:
    """Return this drop's value, the baseline's and the difference, rounded so that they subtract as written."""
    before = math.nan if change.difference is None else change.difference.before.centre
    return subtracted(change.estimate, before, difference_of(change))


def seen_from(change: Change, comparison: Comparison) -> str:
    """Return the smallest difference that would have been flagged; a dash if none would."""
    smallest = comparison.detectable(change)
    return "–" if smallest is None else short(Estimate(smallest, unit=change.kind.unit), width=0.1 * smallest)


def _standing_lines(alarm: Judged) -> list[str]:
    said = f"an earlier alarm stands: {alarm.name}: {alarm.verdict.word}"
    return [said, *(f"  {reason}" for reason in alarm.verdict.reasons)]


def _table(compared: Sequence[Change], comparison: Comparison) -> list[str]:
    """Return a header and a line for each change, with a star before those flagged, in aligned columns."""
    rows = [("", "this drop", "before", "n", "seen from", "difference (95 %)")]
    for each in compared:
        this, before, difference = values_of(each)
        n = 0 if each.difference is None else each.difference.before.n
        rows.append((each.title, this, before, f"{n}", seen_from(each, comparison), difference))
    widths = [max(len(cell) for cell in column) + 2 for column in zip(*rows, strict=True)]
    marks = [" ", *("*" if change.flag else " " for change in compared)]
    return [
        f"{mark} {row[0]:<{widths[0]}}"
        + "".join(f"{cell:>{width}}" for cell, width in zip(row[1:5], widths[1:5], strict=True))
        + f"   {row[5]}"
        for mark, row in zip(marks, rows, strict=True)
    ]
