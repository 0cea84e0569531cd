"""Report section: changes since the reference drops."""

from __future__ import annotations

from tdbmon.diagnosis.reference import APART, Reference
from tdbmon.quantity import words
from tdbmon.remarks import grouped
from tdbmon.report.document import Block, Paragraph, Row, Section, Table


def section(since: Reference) -> Section:
    """Return the findings of the reference drops, and the machine's values that changed since."""
    before = since.before
    names = [drop.name for drop in before.plain.problem.drops]
    shown = " or ".join(dict.fromkeys(each.words for each in before.verdict.accused))
    known = f"Verdict: {before.verdict.kind}."
    if shown:
        stands = [free.words for free in before.verdict.accused[0].problem.free if not free.of_each_drop]
        differs = "does not include it, since its angle or number differs from drop to drop"
        has = f"includes {' and '.join(stands)}" if stands else differs
        known = f"They already show {shown}; the model of the later drops {has}."
    blocks: list[Block] = [Paragraph(f"Reference: {', '.join(names)}. {known}")]
    if since.changes:
        rows = tuple(Row((each.name, words(each.before), words(each.since))) for each in since.changes)
        blocks.append(Table("Values of the machine that changed", ("Value", "Reference", "Since"), rows))
    if since.not_compared:
        blocks.append(Paragraph(f"Not compared: {since.not_compared}."))
    if since.compares and not since.changes:
        blocks.append(
            Paragraph(
                f"No {'other ' if since.not_compared else ''}value of the machine changed by more than {APART:g} times the half"
                " widths of both intervals and by half of its tolerance (a ball clearance: by all of it)."
            )
        )
    blocks += [Paragraph(remark) for remark in grouped(since.remarks, names)]
    return Section("Changed since the reference drops", tuple(blocks))
