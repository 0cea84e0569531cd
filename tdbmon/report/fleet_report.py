"""The report of a fleet: its machines, worst first."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

from tdbmon.history.fleet import REASONS, Member
from tdbmon.history.life import Life
from tdbmon.history.not_compared import not_compared_count, not_compared_sentences
from tdbmon.history.verdict import beside
from tdbmon.quantity import percent, short, words
from tdbmon.record.synthetic import synthetic_note
from tdbmon.report.document import Document, Figure, Paragraph, Row, Section, Table
from tdbmon.report.document import Verdict as Finding
from tdbmon.report.sections.judgement import STANDING, WORDS


def build_fleet_report(members: list[Member]) -> Document:
    """Return the report of a fleet as a document."""
    from tdbmon.figures.fleet import fleet

    synthetic = sum(m.synthetic for m in members)
    return Document(
        "Fleet report",
        f"{len(members)} machines",
        (
            Section(
                "Machines, worst first", (_finding(members), Paragraph(STANDING), _table(members), _life_table(members))
            ),
            Section(
                "Radius at rest over the drops",
                (
                    Figure(
                        "fleet",
                        "Change of the radius at rest since the first of the matching drops, up to the drop by which each machine"
                        " is judged, with 95 % intervals of each drop's own estimate; worst machine first. All panels share the"
                        " scale. Horizontal line: limit of growth, of the end that reaches it first. Grey, at the lower"
                        " edge: not estimated from the drop by which the machine is judged.",
                        "A panel for each machine with the change of the radius at rest at each end against the drop.",
                        partial(fleet, members),
                    ),
                ),
            ),
            *_reasons(members),
        ),
        note=synthetic_note(synthetic, sum(m.drops for m in members)),
    )


def _reasons(members: list[Member]) -> list[Section]:
    """Return the sections on the reasons for alarms, other differences, and quantities that could not be compared."""
    why = []
    for m in members:
        why += [(m.machine, each.name, reason) for each in m.standing for reason in each.verdict.reasons[:REASONS]]
        why += [(m.machine, m.judged.name, reason) for reason in _told_beside(m)]
    untold = [(m.machine, reason) for m in members for reason in not_compared_sentences(m.comparison)]
    tables = (
        _listed("Why", ("Machine", "Drop", "Reason"), why),
        _listed("Not compared", ("Machine", "Quantities and reason"), untold),
    )
    blocks = tuple(table for table in tables if table.rows)
    return [Section("Reasons", blocks)] if blocks else []


def _listed(caption: str, header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> Table:
    """Return rows as a table in which leading cells equal to those of the row above are left blank."""
    named: list[tuple[str, ...]] = [("",) * len(header), *rows]
    cells = [
        tuple("" if row[: k + 1] == above[: k + 1] else cell for k, cell in enumerate(row))
        for above, row in pairwise(named)
    ]
    return Table(caption, header, tuple(Row(each) for each in cells))


def _told_beside(member: Member) -> list[str]:
    """Return remarks on the judged drop of a machine besides its verdict, unless they are among the reasons listed above."""
    above = member.verdict.reasons[:REASONS] if member.standing else ()
    return [each for each in beside(member.comparison) if each not in above]


def _table(members: list[Member]) -> Table:
    rows = []
    for member in members:
        latest, changed = member.latest.comparison, member.comparison.flagged
        cells = (
            member.machine,
            member.verdict.word,
            member.judged.name,
            f"{member.drops}",
            "this one" if latest.entry.id == member.comparison.entry.id else latest.entry.when,
            "; ".join(c.title for c in changed[:2]) + (" …" if len(changed) > 2 else "") or "–",
            not_compared_count(member.comparison),
        )
        rows.append(Row(cells, WORDS[member.verdict.word][1]))
    header = ("Machine", "Verdict", "By the drop", "Drops", "Latest", "Changed", "Not compared")
    return Table("Each machine, judged by its standing alarm, otherwise by its latest drop", header, tuple(rows))


def _life_table(members: list[Member]) -> Table:
    """Return the usage of each machine's bearings up to its latest drop; damage, margin and stress only if any has one."""
    lives = [m.latest.comparison.life for m in members]
    damaged, agreed = any(each.damage.known for each in lives), any(each.margin.known for each in lives)
    stressed = any(m.hardest for m in members)
    rows = []
    for member, life in zip(members, lives, strict=True):
        cells = [member.machine, f"{life.full_drops}", "none" if life.agreed is None else f"{life.agreed}"]
        cells += [_damage(life)] * damaged
        cells += [words(life.margin) if life.margin.known else "–"] * agreed
        cells += [_stress(member)] * stressed
        used_up = life.margin.value is not None and life.margin.value <= 0
        rows.append(Row(tuple(cells), "attention" if used_up else "plain"))
    header = ["Machine", "Full drops", "Agreed"]
    header += ["Damage, drops"] * damaged + ["Margin, drops"] * agreed + ["Greatest stress (of the limit)"] * stressed
    return Table("Number of drops against the agreed number, and the greatest stress", tuple(header), tuple(rows))


def _damage(life: Life) -> str:
    """Return the greatest damage of any end, with the end's name."""
    worst = [end for end, each in life.damages.items() if each == life.damage]
    return f"{short(life.damage)} at {worst[0]}" if worst else "–"


def _stress(member: Member) -> str:
    """Return the greatest stress of the latest drop and its matching drops, relative to the limit."""
    if member.hardest is None:
        return "–"
    end, stress = member.hardest
    return f"{stress * 1e-6:.0f} MPa at {end} ({percent(stress / member.comparison.settings.inspect.stress)})"


def _finding(members: list[Member]) -> Finding:
    """Return the number of machines with standing alarms, and of those with too few drops, which do not count as good."""
    alarms = sum(bool(m.standing) for m in members)
    few = sum(m.verdict.word == "too few drops" for m in members)
    asks = f"{alarms or 'None'} of {len(members)} machines {'needs' if alarms < 2 else 'need'} attention"
    also = f"; {few} {'has' if few == 1 else 'have'} too few matching drops for a verdict" if few else ""
    return Finding(f"{asks}{also}.", "attention" if alarms else "plain" if few else "good")
