"""The machine's own values, as the model that the verdict believes was fitted with them, beside those of its file."""

from __future__ import annotations

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.verdict import Kind
from tdbmon.estimate import Estimate
from tdbmon.identify.parameters import file_values
from tdbmon.quantity import words
from tdbmon.report.document import Row, Section, Table
from tdbmon.report.sections.fitted_values import toleranced, value_words

_EDGE = 1e-3  # of a tolerance: so near to its end a value has gone as far as it may


def section(evidence: Evidence) -> Section | None:
    """Return the table; None where no model is believed, whose values have made up for what it lacks."""
    diagnosis = evidence.diagnosis
    if diagnosis.verdict.kind is Kind.UNKNOWN or not diagnosis.values:
        return None
    machine, stated = diagnosis.machine, file_values(diagnosis.machine)
    rows = []
    for name, value in diagnosis.values.items():
        entry = stated.get(name)
        at_edge = entry is not None and not entry.is_exact and _at_edge(value, entry.low, entry.high)
        told = toleranced(entry, value.unit) if entry is not None else "–"
        remark = "as far off as the file lets it go: the truth may lie beyond" if at_edge else ""
        rows.append(Row((value_words(name, machine), words(value), told, remark)))
    header = ("Value", "Fitted", "Machine file (tolerance)", "Remark")
    caption = "Values to which the machine file gives a tolerance, as these drops have them (95 % intervals)"
    return Section("Values of the machine", (Table(caption, header, tuple(rows)),))


def _at_edge(value: Estimate, low: float, high: float) -> bool:
    """True where a known value lies at an end of its tolerance."""
    near = _EDGE * (high - low)
    return value.value is not None and not low + near < value.value < high - near
