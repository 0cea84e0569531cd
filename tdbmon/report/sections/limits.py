"""Report section: quantities not estimated, with the reasons."""

from __future__ import annotations

from tdbmon.analysis.result import Analysis
from tdbmon.report.document import Block, Paragraph, Row, Section, Table
from tdbmon.report.sections.findings import all_findings

_MODEL = "not determined by displacement alone: it needs the simulation fitted to the record (tdbmon analyse --forces)"


def section(analysis: Analysis, fitted: bool = False) -> Section:
    """Return all quantities without a value, grouped by reason; `fitted` if a model provides the forces."""
    rows = []
    if not fitted and analysis.falls:
        rows = [
            Row(("Contact force, Hertz stress", "both", _MODEL)),
            Row(("Support stiffness and damping separately", "both", _MODEL)),
            Row(("Speed of the inner rings", "both", "no channel measures it")),
        ]
    missing: dict[tuple[str, str], list[str]] = {}
    for finding in all_findings(analysis):
        if not finding.estimate.known:
            missing.setdefault((finding.end or "rotor", finding.estimate.why), []).append(finding.name)
    rows += [Row(("; ".join(names), end, why)) for (end, why), names in missing.items()]
    blocks: list[Block] = [
        Paragraph(
            "Nothing is guessed: a number that the record cannot support is missing, and the reason is given here."
        ),
        Table("Not estimated", ("Quantity", "End", "Why"), tuple(rows)),
    ]
    return Section("What is not estimated", tuple(blocks))
