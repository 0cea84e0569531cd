"""The report of a fleet: its machines, worst first."""

from __future__ import annotations

from functools import partial

from tdbmon import __version__
from tdbmon.history.fleet import Member
from tdbmon.history.not_compared import not_compared_count, not_compared_sentences
from tdbmon.record.synthetic import synthetic_note
from tdbmon.report.document import Document, Figure, Paragraph, Row, Section, Table
from tdbmon.report.document import Verdict as Finding
from tdbmon.report.quantity import moment, words
from tdbmon.report.sections.judgement import WORDS


def build_fleet_report(members: list[Member], note: str = "") -> Document:
    """Return the report of a fleet as a document."""
    from tdbmon.figures.fleet import fleet

    if not note and any(m.comparison.entry.synthetic for m in members):
        note = synthetic_note(sum(m.drops for m in members))
    alarms = [m for m in members if m.verdict.alarm]
    if alarms:
        first = Finding(f"{len(alarms)} of {len(members)} machines ask for attention.", "attention")
    else:
        first = Finding(f"None of {len(members)} machines asks for attention.", "good")
    rows = []
    for member in members:
        entry = member.comparison.entry
        changed = member.comparison.flagged
        rows.append(
            Row(
                (
                    member.machine,
                    member.verdict.word,
                    f"{member.drops}",
                    moment(entry.dropped) if entry.dropped else "–",
                    "; ".join(c.title for c in changed[:2]) + (" …" if len(changed) > 2 else "") or "–",
                    not_compared_count(member.comparison),
                    words(member.comparison.life.margin) if member.comparison.life.margin.known else "–",
                ),
                WORDS[member.verdict.word][1],
            )
        )
    header = ("Machine", "Verdict", "Drops", "Latest", "Changed", "Not compared", "Margin, drops")
    reasons = [Paragraph(f"{m.machine}: {'; '.join(m.verdict.reasons[:3])}.") for m in alarms[:20]]
    lost = [(m.machine, sentence) for m in members for sentence in not_compared_sentences(m.comparison)]
    reasons += [Paragraph(f"{machine}: {sentence}.") for machine, sentence in lost[:40]]
    return Document(
        "Fleet report",
        f"{len(members)} machines",
        (
            Section("Machines, worst first", (first, Table("The latest drop of each", header, tuple(rows)), *reasons)),
            Section(
                "Radius at rest over the drops",
                (
                    Figure(
                        "fleet",
                        "Radius at rest of each machine's drops at the speed of its latest one, less that of the first, with"
                        " 95 % intervals of each drop's own estimate; worst machine first. All panels share the scale.",
                        "A panel for each machine with the change of the radius at rest at each end against the drop.",
                        partial(fleet, members),
                    ),
                ),
            ),
        ),
        note=note,
        made=f"tdbmon {__version__}",
    )
