"""Report section: the values of a drop with too few earlier drops for statistics, beside those of the earlier drops."""

from __future__ import annotations

from tdbmon.history.compare import Comparison
from tdbmon.history.difference import LEAST_JUDGED
from tdbmon.quantity import counted, short, words
from tdbmon.report.document import Paragraph, Row, Section, Table
from tdbmon.report.sections.judgement import speed_wanted

_SHOWN = 4  # latest earlier drops shown, as many columns as fit the page


def section(comparison: Comparison) -> Section | None:
    """Return the values side by side; None if there are enough drops, or if the record contains no drop."""
    least, before = comparison.settings.compare.least_drops, comparison.matched
    if len(before) >= least or comparison.no_drop:
        return None
    shown = before[-_SHOWN:]
    rows = []
    for change in comparison.changes:
        values = {drop: short(e, change.estimate.width) for drop, e in change.earlier}
        own = words(change.estimate) if change.estimate.known else "–"
        rows.append(Row((change.title, own, *(values.get(entry.id, "–") for entry in shown))))
    header = ("Quantity", comparison.entry.raw_name, *(entry.raw_name for entry in shown))
    return Section(
        "Values of this drop",
        (Paragraph(_missing(comparison)), Table("This drop beside the matching earlier drops", header, tuple(rows))),
    )


def _missing(comparison: Comparison) -> str:
    """Return a text on the drops still needed for a verdict."""
    least, n, wanted = comparison.settings.compare.least_drops, len(comparison.matched), comparison.conditions
    assembly = f", assembly {wanted.assembly}" if wanted.assembly else ", without an assembly name"
    return (
        "There are too few drops for statistics: the values are listed side by side, this drop's with the 95 % interval of its"
        f" own estimate. The verdict “as before” needs {counted(least - n, 'more earlier drop')} of {wanted.machine}"
        f"{assembly}, speed at the release {speed_wanted(wanted)}, with sound probes; a change can be flagged with"
        f" {LEAST_JUDGED} earlier drops."
    )
