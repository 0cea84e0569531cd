"""Next steps after an alarm: headroom of a grown gap to its limit, and recommended actions with their commands."""

from __future__ import annotations

import shlex

from tdbmon.estimate import Estimate
from tdbmon.history.change import Change
from tdbmon.history.compare import Comparison
from tdbmon.history.headroom import Headroom, headroom
from tdbmon.history.matching import doubted_probes
from tdbmon.history.standing import Judged
from tdbmon.history.summary import difference_of
from tdbmon.quantity import counted, percent, short, stated_percent, words
from tdbmon.report.document import Block, Row, Table

_DROPS = 3  # of each condition, for a diagnosis: one drop is held out for validation


def blocks(judged: Judged) -> list[Block]:
    """Return the headroom of grown gaps and the next steps; an empty list without growth or alarm."""
    grown = headroom(judged.comparison)
    found: list[Block] = []
    if grown:
        header = ("Quantity", "Grown by", "As growth of the radius at rest", "Limit", "Left")
        found.append(Table("How far the gap is from its limit", header, tuple(map(_room, grown))))
    if judged.verdict.word in ("inspect", "changed"):
        found.append(Table("What to do next", ("What", "How"), tuple(_steps(judged))))
    return found


def _room(room: Headroom) -> Row:
    change, limit = room.change, stated_percent(room.limit)
    grown = words(difference_of(change))
    if room.growth is None or room.radius is None:
        return Row((change.title, grown, "no earlier drop gives a radius", limit, "not known"))
    left = (room.limit - room.growth) * room.radius
    return Row(
        (
            change.title,
            grown,
            f"{percent(room.growth, 1)} of {_length(room.radius)}",
            f"{limit}, {_length(room.limit * room.radius)}",
            _length(left) if left > 0 else "none: the limit is exceeded",
        ),
        "plain" if left > 0 else "attention",
    )


def _length(length: float) -> str:
    """Return a length as text, rounded to the micrometre."""
    return short(Estimate(length, unit="um"), 1e-5)


def _steps(judged: Judged) -> list[Row]:
    comparison = judged.comparison
    entry, flagged = comparison.entry, comparison.flagged
    failed = doubted_probes(entry.failed_checks)
    grown = {each.change.end for each in headroom(comparison)}
    ends = sorted(
        (end for end in comparison.ends if any(end == c.end for c in flagged)), key=lambda end: end not in grown
    )
    where = f" at {', then '.join(ends)}" if ends else ""
    rows = []
    if failed:
        rows.append(Row(("Check the probes first", f"checks failed: {', '.join(failed)}; then drop again")))
    if judged.verdict.word == "inspect":
        rows.append(
            Row(("Inspect", f"the touchdown bearings{where} before the next start: journal, rings, balls, support"))
        )
    else:
        rows.append(
            Row(
                (
                    "Inspect",
                    f"at the next stop: journal, rings, balls and support{where}; no limit that requires it at once is exceeded",
                )
            )
        )
    if flagged and not failed:
        rows.append(Row(("Look for the cause", diagnosis_command(comparison, flagged))))
    life = comparison.life
    drops = counted(life.full_drops, "full drop")
    if life.agreed is None:
        room = f"{drops} so far; no number is agreed: set agreed_drops in archive.toml"
    else:
        room = f"{drops} of {life.agreed} agreed; margin {words(life.margin)}"
    rows.append(Row(("Before another drop", room)))
    rows.append(
        Row(("After an overhaul", "file the drops from then on under a new assembly name: tdbmon archive add --assembly NAME"))
    )
    return rows


def diagnosis_command(comparison: Comparison, flagged: tuple[Change, ...]) -> str:
    """Return the command for a diagnosis of the drops since the change, with those before it as reference."""
    changed = [e for e in comparison.matched if all(e.id in change.left_out for change in flagged)]
    sound = [e for e in comparison.matched if not any(e.id in change.left_out for change in flagged)]
    later, earlier = (
        " ".join(shlex.quote(e.raw_name) for e in each[-_DROPS:]) for each in ([*changed, comparison.entry], sound)
    )
    return f"tdbmon diagnose machine.toml {later}" + (f" --reference {earlier}" if earlier else "")
