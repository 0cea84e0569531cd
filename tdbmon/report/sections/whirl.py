"""Report section: whirl of the shaft around its clearance, with and against the rotation."""

from __future__ import annotations

from tdbmon.analysis.result import Analysis
from tdbmon.estimate import Estimate
from tdbmon.quantity import words
from tdbmon.report.document import Block, Paragraph, Row, Section, Table


def section(analysis: Analysis) -> Section | None:
    """Return the section on the whirl of each end; None without a drop."""
    if not analysis.ends or not analysis.falls:
        return None
    blocks: list[Block] = [
        Paragraph(
            "Backward whirl, in which friction drives the shaft around the clearance against its rotation, can destroy"
            " touchdown bearings. It is counted as whirl if the shaft centre goes around the clearance centre by a full"
            " turn or more; a shaft that swings at the bottom reverses before that."
        )
    ]
    if not analysis.whirl:
        blocks.append(Paragraph("Whirl could not be detected: no end is measured by two probes."))
        return Section("Whirl", tuple(blocks))
    rows = tuple(
        Row(
            (
                end,
                _found(w.backward, w.backward_onset),
                _found(w.full, w.full_onset),
                words(w.frequency) if w.frequency.known else "–",
            ),
            "attention" if w.backward or w.full or w.hidden else "plain",
        )
        for end, w in analysis.whirl.items()
    )
    header = ("End", "Backward whirl", "Full whirl, in either sense", "Frequency of the longest")
    blocks.append(Table("Whirl after the release (times from the record's first sample)", header, rows))
    drawn = [end for end, w in analysis.whirl.items() if w.drawn]
    for end, w in analysis.whirl.items():
        if w.hidden:
            blocks.append(Paragraph(f"At {end} {w.hidden}."))
    if drawn:
        blocks.append(
            Paragraph(
                f"At {' and '.join(drawn)} no clearance circle was found: the gap of the drawing about the probes' zero"
                " is used instead."
            )
        )
    return Section("Whirl", tuple(blocks))


def _found(found: bool | None, onset: Estimate) -> str:
    if found is None:
        return "not judged"
    return f"from {words(onset)}" if found else "none found"
