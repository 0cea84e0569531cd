"""The report of the comparison of one drop with earlier ones."""

from __future__ import annotations

from collections.abc import Sequence

from tdbmon.history.standing import Judged
from tdbmon.quantity import moment
from tdbmon.record.synthetic import synthetic_note
from tdbmon.report.document import Document, Section
from tdbmon.report.sections import changes, comparison_methods, few_drops, judgement, life, stress_history, trends


def build_compare_report(judged: Judged, standing: Sequence[Judged] = ()) -> Document:
    """Return the report of a comparison as a document; `write_html` and `write_pdf` write it.

    Parameters
    ----------
    judged : Judged
        The drop.
    standing : sequence of Judged, optional
        Standing alarms of earlier drops (`tdbmon.history.standing.standing_beside`).
    """
    comparison = judged.comparison
    entry = comparison.entry
    synthetic = sum(e.synthetic for e in (*comparison.matched, entry))
    parts: list[Section | None] = [
        judgement.section(judged, standing),
        few_drops.section(comparison),
        changes.section(comparison),
        stress_history.section(comparison),
        trends.section(comparison),
        life.section(comparison),
        comparison_methods.section(comparison),
    ]
    when = moment(entry.dropped) if entry.dropped else "time not stated"
    return Document(
        "Comparison with earlier drops",
        f"{entry.machine} · {when} · {entry.raw_name}",
        tuple(part for part in parts if part is not None),
        note=synthetic_note(synthetic, 1 + len(comparison.matched)),
    )
