"""Report section: the machine's values fitted with the model accepted by the verdict, beside those of its file."""

from __future__ import annotations

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.reference import Reference
from tdbmon.diagnosis.verdict import Kind
from tdbmon.estimate import Estimate
from tdbmon.identify.parameters import file_values
from tdbmon.quantity import words
from tdbmon.report.document import Row, Section, Table
from tdbmon.report.sections.fitted_values import toleranced, value_words

_EDGE = 1e-3  # of the tolerance range: a value so near to its end is at the bound


def section(evidence: Evidence, since: Reference | None = None) -> Section | None:
    """Return the table; None if no model is accepted, since the fitted values then compensate for what the model lacks.

    A value that changed beyond its tolerance `since` earlier drops is compared with the file's value, not the fit's starting one.
    """
    diagnosis = evidence.diagnosis
    if diagnosis.verdict.kind is Kind.UNKNOWN or not diagnosis.values:
        return None
    machine = since.before.machine if since is not None else diagnosis.machine
    stated, fitted = file_values(machine), file_values(diagnosis.machine)
    rows = []
    for name, value in diagnosis.values.items():
        entry, range_ = stated.get(name), fitted.get(name)
        remark = ""
        if range_ is not None and not range_.is_exact and _at_edge(value, range_.low, range_.high):
            remark = "at the limit of its tolerance: the true value may lie beyond"
        elif entry is not None and range_ != entry:
            remark = "changed beyond its tolerance since the reference drops"
        told = toleranced(entry, value.unit) if entry is not None else "–"
        rows.append(Row((value_words(name, machine), words(value), told, remark)))
    header = ("Value", "Fitted", "Machine file (tolerance)", "Remark")
    these = "these drops" if len(diagnosis.plain.problem.drops) > 1 else "this drop"
    caption = (
        f"Values with a tolerance in the machine file, fitted to {these} (95 % intervals, for exact laws of the model;"
        " if the laws are slightly wrong, the true value may lie further away)"
    )
    return Section("Values of the machine", (Table(caption, header, tuple(rows)),))


def _at_edge(value: Estimate, low: float, high: float) -> bool:
    """True if a known value lies at a bound of its tolerance."""
    near = _EDGE * (high - low)
    return value.value is not None and not low + near < value.value < high - near
