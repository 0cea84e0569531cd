"""The report of a diagnosis, with the evidence in the order in which a reader would assess it."""

from __future__ import annotations

from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.evidence import evidence_of
from tdbmon.diagnosis.reference import Reference
from tdbmon.report.document import Document, Section
from tdbmon.report.sections import (
    diagnosis_changes,
    diagnosis_fit,
    diagnosis_force,
    diagnosis_gain,
    diagnosis_late_record,
    diagnosis_ranking,
    diagnosis_remains,
    diagnosis_residual,
    diagnosis_sizes,
    diagnosis_slowing,
    diagnosis_values,
    diagnosis_verdict,
)


def build_diagnosis_report(diagnosis: Diagnosis, note: str = "", since: Reference | None = None) -> Document:
    """Return the report of a diagnosis as a document; `write_html` and `write_pdf` write it.

    Parameters
    ----------
    diagnosis : Diagnosis
    note : str, optional
        Shown under the title, e.g. that the records are synthetic, which the diagnosis itself does not state.
    since : Reference, optional
        Earlier drops with which these were compared.

    Raises
    ------
    InputError
        If a model cannot be simulated to the horizon of the most probable one.
    """
    evidence = evidence_of(diagnosis)
    parts: list[Section | None] = [
        diagnosis_verdict.section(evidence),
        diagnosis_changes.section(since) if since is not None else None,
        diagnosis_fit.plain(evidence),
        diagnosis_residual.section(evidence),
        diagnosis_force.section(evidence),
        diagnosis_ranking.section(evidence),
        diagnosis_fit.extended(evidence),
        diagnosis_slowing.section(evidence),
        diagnosis_late_record.section(evidence),
        diagnosis_gain.section(evidence),
        diagnosis_sizes.section(evidence),
        diagnosis_values.section(evidence, since),
        diagnosis_remains.remains(evidence),
        diagnosis_remains.next_test(evidence),
    ]
    drops = [drop.name for drop in diagnosis.plain.problem.drops]
    return Document(
        "Diagnosis: what the model lacks" if since is None else "Diagnosis: what has changed",
        f"{diagnosis.machine.name} · {', '.join(drops)}",
        tuple(part for part in parts if part is not None),
        note=note,
    )
