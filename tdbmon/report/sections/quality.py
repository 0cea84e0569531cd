"""Report section: the quality gate, all checks of the record, failures first."""

from __future__ import annotations

from tdbmon.analysis.result import Analysis
from tdbmon.record.finding import Check
from tdbmon.report.document import Block, Paragraph, Row, Section, Table


def section(analysis: Analysis) -> Section:
    """Return the checks of the record; passed ones are merged to one row per kind of check, failed ones have a row each."""
    failed = [check for check in analysis.checks if not check.passed]
    passed = [check for check in analysis.checks if check.passed]
    blocks: list[Block] = []
    if failed:
        rows = tuple(Row((c.check, c.channel or "record", c.detail), "attention") for c in failed)
        blocks.append(Table("Checks that failed", ("Check", "Channel", "What was found"), rows))
    else:
        blocks.append(Paragraph("No check failed."))
    if passed:
        names = list(dict.fromkeys(check.check for check in passed))
        rows = tuple(_row(name, [c for c in passed if c.check == name]) for name in names)
        blocks.append(Table("Checks that passed", ("Check", "Channels", "What was found"), rows))
    return Section("Can the record be trusted?", tuple(blocks))


def _row(name: str, checks: list[Check]) -> Row:
    details = list(dict.fromkeys(c.detail for c in checks))
    if len(details) == 1:
        said = details[0]
    else:
        said = "; ".join(f"{c.channel}: {c.detail}" if c.channel else c.detail for c in checks)
    return Row((name, ", ".join(c.channel for c in checks if c.channel) or "record", said))
