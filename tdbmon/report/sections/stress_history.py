"""Report section: Hertz stress of the drops, as box plots by end and drop and a table of greatest and mean values."""

from __future__ import annotations

from functools import partial

from tdbmon.history.compare import Comparison
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table


def section(comparison: Comparison) -> Section:
    """Return the section on the stresses, or a sentence that no drop has any."""
    if not comparison.stress:
        words = (
            f"Neither {comparison.entry.raw_name} nor a drop that matches it was filed with forces. A stress needs the"
            " simulation fitted to the drop: tdbmon archive add --forces."
        )
        return Section("Hertz stress", (Paragraph(words),))
    from tdbmon.figures.stress_history import stress_history
    from tdbmon.identify.forces import SECONDS

    drops = [e.id for e in (*comparison.matched, comparison.entry)]
    with_forces = {drop for rows in comparison.stress.values() for drop, _ in rows}
    without = [drop for drop in drops if drop not in with_forces]
    rows = []
    for drop in drops:
        cells = []
        for boxes in comparison.stress.values():
            box = dict(boxes).get(drop)
            cells.append("–" if box is None else f"{box.greatest * 1e-6:.0f} / {box.mean * 1e-6:.0f} MPa")
        if drop in with_forces:
            rows.append(Row((comparison.record(drop), *cells)))
    blocks: list[Block] = [
        Figure(
            "stress-history",
            f"Greatest Hertz stress among the balls while any is loaded, within {SECONDS:g} s of the release, from the simulation"
            " fitted to each drop. Box: quartiles with median; cross: mean; bar above: greatest (the least is"
            " not filed); rings: peaks beyond three standard deviations from the mean. In orange:"
            f" {comparison.entry.raw_name}.",
            "Box plots of the stress, a panel for each end and a box for each drop.",
            partial(stress_history, comparison),
        ),
        Table("Greatest / mean stress", ("Drop", *comparison.stress), tuple(rows)),
    ]
    if without:
        blocks.append(
            Paragraph(
                "Without a box, since filed without forces or with a fit that gave none:"
                f" {', '.join(map(comparison.record, without))}."
            )
        )
    return Section("Hertz stress", tuple(blocks))
