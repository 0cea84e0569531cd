"""Report section: usage of the bearings against the agreed number of drops."""

from __future__ import annotations

from tdbmon.estimate import Estimate
from tdbmon.history.compare import Comparison
from tdbmon.history.feature import place_of
from tdbmon.quantity import capitalised, words
from tdbmon.report.document import Paragraph, Row, Section, Table
from tdbmon.report.sections.judgement import included


def section(comparison: Comparison) -> Section:
    """Return the section with counts of drops, damage and margin."""
    life = comparison.life
    ends = sorted(life.damages, key=lambda end: place_of(end, comparison.ends))
    used_up = life.margin.value is not None and life.margin.value <= 0
    rows = (
        Row((f"Full drops of this assembly, {included(comparison)}", f"{life.full_drops}")),
        Row(("Partial drops", f"{life.partial_drops}")),
        Row(("Agreed between vendor and user", "none stated" if life.agreed is None else f"{life.agreed}")),
        *(Row((f"Damage at {end}, in drops like the first", words(life.damages[end]))) for end in ends),
        *(() if ends else (Row(("Damage, in drops like the first", words(life.damage))),)),
        Row(
            ("Margin, by the worse end" if len(ends) > 1 else "Margin", words(life.margin)),
            "attention" if used_up else "plain",
        ),
    )
    return Section(
        "Drops and life",
        (
            Table("Drops against the agreed number", ("What", "Value"), rows),
            Paragraph(_explanation(life.damage)),
        ),
    )


def _explanation(damage: Estimate) -> str:
    said = (
        "API 617 requires that touchdown bearings survive an agreed number of drops from full speed, at least two;"
        " ISO 14839-4 leaves the number to vendor and user."
    )
    if not damage.known:
        return said
    said += (
        f" The damage is the {damage.method}: it compares drops of one machine by the ninth power of their Hertz stresses"
        " and is not a life in hours."
    )
    return said + (f" {capitalised(damage.why)}." if damage.why else "")
