"""Whirl: does the shaft run around its clearance, and against its rotation?"""

from __future__ import annotations

from tdbmon.analysis.result import Analysis
from tdbmon.report.document import Block, Paragraph, Row, Section, Table
from tdbmon.report.quantity import words


def section(analysis: Analysis) -> Section | None:
    """Return the whirl of each end."""
    if not analysis.ends:
        return None
    blocks: list[Block] = [
        Paragraph(
            "Sustained backward whirl, in which friction drives the shaft around the clearance against its rotation, is the"
            " failure that touchdown bearings fear most. It is looked for from the release on, about the clearance centre."
        )
    ]
    if not analysis.whirl:
        blocks.append(Paragraph("It could not be looked for: no clearance circle was found."))
        return Section("Whirl", tuple(blocks))
    rows = tuple(
        Row(
            (end, _found(w.backward, words(w.backward_onset)), _found(w.full, words(w.full_onset))),
            "attention" if w.backward or w.full else "plain",
        )
        for end, w in analysis.whirl.items()
    )
    blocks.append(
        Table("Whirl after the release", ("End", "Sustained backward whirl", "Whirl around the whole clearance"), rows)
    )
    return Section("Whirl", tuple(blocks))


def _found(found: bool, onset: str) -> str:
    return f"yes, from {onset}" if found else "none found"
