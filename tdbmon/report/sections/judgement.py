"""The first page of a comparison: the verdict and its reasons, and what was compared with what."""

from __future__ import annotations

from tdbmon.history.compare import Comparison
from tdbmon.history.verdict import Verdict
from tdbmon.report.document import Block, Paragraph, Row, Section, Table, Tone
from tdbmon.report.document import Verdict as Finding
from tdbmon.report.quantity import moment

WORDS: dict[str, tuple[str, Tone]] = {
    "as before": ("As before.", "good"),
    "changed": ("Changed against the drops before.", "attention"),
    "inspect": ("Inspect the touchdown bearings before the next start.", "attention"),
    "too few drops": ("Too few matching drops for a verdict.", "plain"),
}


def section(comparison: Comparison, verdict: Verdict) -> Section:
    """Return the verdict."""
    words, tone = WORDS[verdict.word]
    wanted, entry = comparison.conditions, comparison.entry
    speed = "unknown" if wanted.speed is None else f"{wanted.speed:.4g} Hz, at most {wanted.tolerance:.0%} off"
    blocks: list[Block] = [Finding(words, tone), *(Paragraph(_capital(reason) + ".") for reason in verdict.reasons)]
    rows = [
        Row(("Drop", f"{entry.id} ({entry.raw_name})")),
        Row(("Machine", wanted.machine)),
        Row(("Assembly", wanted.assembly or "not told apart")),
        Row(("Speed at the release", speed)),
        Row(("Matching drops before", f"{len(comparison.matched)}")),
        Row(("Quantities compared", f"{comparison.tested}, corrected for that number together")),
    ]
    blocks.append(Table("What was compared", ("What", "Value"), tuple(rows)))
    if comparison.matched:
        listed = tuple(
            Row(
                (
                    e.id,
                    e.raw_name,
                    moment(e.dropped) if e.dropped else "–",
                    "–" if e.speed is None else f"{e.speed:.4g} Hz",
                )
            )
            for e in (*comparison.matched[-20:], entry)
        )
        more = len(comparison.matched) - 20
        caption = "The drops, this one last" + (f" ({more} older ones not listed)" if more > 0 else "")
        blocks.append(Table(caption, ("Drop", "Record", "Time", "Speed"), listed))
    return Section("Verdict", tuple(blocks))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
