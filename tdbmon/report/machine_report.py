"""The report of a machine over all its drops."""

from __future__ import annotations

from functools import partial

from tdbmon.history.change import Change
from tdbmon.history.machine_history import Course, MachineHistory
from tdbmon.history.matching import doubts
from tdbmon.history.not_compared import not_compared_count, not_compared_sentences
from tdbmon.quantity import counted, decapitalised, short, stated_percent, words
from tdbmon.record.synthetic import synthetic_note
from tdbmon.report.document import Block, Document, Figure, Paragraph, Row, Section, Table, Tone, sentence
from tdbmon.report.document import Verdict as Finding
from tdbmon.report.sections import comparison_methods, life, stress_history
from tdbmon.report.sections.judgement import WORDS, standing_blocks

_TONE: dict[str, Tone] = {word: tone for word, (_, tone) in WORDS.items()}


def build_machine_report(history: MachineHistory) -> Document:
    """Return the report of a machine as a document."""
    last = history.last
    synthetic = sum(e.synthetic for e in history.entries)
    parts = [
        _summary(history),
        _courses(history),
        stress_history.section(last.comparison),
        life.section(last.comparison),
        comparison_methods.section(last.comparison),
    ]
    return Document(
        "Machine report",
        f"{history.machine} · {counted(len(history.entries), 'drop')}",
        tuple(parts),
        note=synthetic_note(synthetic, len(history.entries)),
    )


def _summary(history: MachineHistory) -> Section:
    last = history.last
    judged_as, tone = WORDS[last.verdict.word]
    blocks = standing_blocks(history.standing_earlier)
    blocks.append(Finding(f"The latest drop: {decapitalised(judged_as)}", tone))
    blocks += map(sentence, (*last.verdict.reasons, *not_compared_sentences(last.comparison)))
    rows = []
    for judged in history.judged:
        entry, changed = judged.comparison.entry, judged.comparison.flagged
        what = "; ".join(c.title for c in changed[:3]) + (f"; {len(changed) - 3} more" if len(changed) > 3 else "")
        word, lost = judged.verdict.word, not_compared_count(judged.comparison)
        rows.append(
            Row((entry.id, entry.raw_name, entry.when, entry.speed_words, word, what or "–", lost), _TONE[word])
        )
    header = ("Drop", "Record", "Time", "Speed", "Verdict", "Changed", "Not compared")
    older = len(history.entries) - len(history.judged)
    caption = "Every drop against those before it" + (f" ({older} older ones not judged)" if older else "")
    return Section("Summary", (*blocks, Table(caption, header, tuple(rows))))


def _courses(history: MachineHistory) -> Section:
    from tdbmon.figures.machine_courses import machine_courses, shown_courses

    rows = tuple(_trend_row(c) for c in history.courses if c.slope.known or c.step is not None)
    shown = "; dotted: a new assembly from there on" if len({e.assembly for e in history.entries}) > 1 else ""
    steps = (
        "; dashed: where a step describes the drops better than a slope"
        if any(c.step for c in shown_courses(history))
        else ""
    )
    rings = "; rings: changed against the earlier drops without a ring" if history.flagged else ""
    blocks: list[Block] = [
        Figure(
            "machine-courses",
            f"The quantities flagged in any {'judged ' * (len(history.judged) < len(history.entries))}drop, and the main"
            " quantities, over all drops in their order, with 95 % intervals where"
            f" they are known; one colour for each class of speed{rings}{steps}{shown}.",
            "For each quantity, its value in each drop.",
            partial(machine_courses, history),
        )
    ]
    doubted = [e.raw_name for e in history.entries if doubts(e.failed_checks)]
    if doubted:
        blocks.append(Paragraph(f"Left out, since checks of their records failed: {', '.join(doubted)}."))
    blocks += _without_ring(history)
    if rows:
        blocks += [
            Table("Trends over all drops", ("Quantity", "Drops", "Slope per drop (95 %)", "Step"), rows),
            Paragraph(
                "One slope by least squares, with a separate level for each speed and each assembly. Where one step of all"
                " levels at once (change point, permutation test) describes the drops better (Schwarz's criterion), it replaces"
                " the slope. A row is marked if the slope's interval excludes zero or a step has p ≤ 5 %; by chance"
                " one in twenty is."
            ),
        ]
    else:
        why = next((c.slope.why for c in history.courses), "no quantity is known")
        blocks.append(Paragraph(f"A trend over all drops together is not estimated: it {why}."))
    return Section("Course over the drops", tuple(blocks))


def _without_ring(history: MachineHistory) -> list[Block]:
    """Return an explanation why drops at the same level as flagged (ringed) ones are not flagged."""
    found = [
        f"{change.title}: {judged.comparison.entry.raw_name} (p = {change.p_adjusted:.2g}, corrected)"
        for judged in history.judged
        for change in judged.comparison.changes
        if _stays_off(change) and not change.flag and not change.as_in and change.key in history.flagged
        if change.p_adjusted is not None and not doubts(judged.comparison.entry.failed_checks)
    ]
    if not found:
        return []
    level = stated_percent(history.last.comparison.settings.compare.significance)
    return [
        Paragraph(
            f"At the level of the ringed drops just before, but without a ring: {'; '.join(found)}. They are compared with the"
            " same earlier drops, but their own values are less certain, or their other quantities differ less clearly: with p"
            f" above {level} a difference may be due to chance."
        )
    ]


def _stays_off(change: Change) -> bool:
    """Whether a drop lies nearer to the deviating drops just before it than to its baseline."""
    if not change.since or change.difference is None:
        return False
    last = (change.earlier[-1][1].value or 0.0) - change.difference.before.centre
    return change.difference.value / last > 1 / 2


def _trend_row(course: Course) -> Row:
    """Return a table row with the slope of a course, or the place and size of its step."""
    start = (course.title, f"{len(course.values)}")
    if course.step is not None:
        by = short(course.rise, 0.1 * abs(course.rise.value or 0.0))
        step = f"by {by} from {course.step.raw_name} on, p = {course.step_p:.2g}"
        return Row((*start, "–", step), "attention")
    low, high = course.slope.low, course.slope.high
    off = low is not None and high is not None and low * high > 0
    return Row((*start, words(course.slope), "–"), "attention" if off else "plain")
