"""The report of one analysed drop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tdbmon.analysis.result import Analysis
from tdbmon.quantity import moment
from tdbmon.record.synthetic import is_synthetic, synthetic_note
from tdbmon.report.document import Document, Section
from tdbmon.report.sections import (
    agreement,
    coast_down,
    contact,
    forces,
    gap,
    limits,
    natural_frequencies,
    orbit,
    quality,
    release,
    rundown,
    source,
    spectra,
    summary,
    tracking,
    whirl,
)

if TYPE_CHECKING:
    from tdbmon.identify.fitted import FittedDrop


def build_report(analysis: Analysis, note: str = "", fitted: FittedDrop | None = None) -> Document:
    """Return the report of a drop as a document; `write_html` and `write_pdf` write it.

    Parameters
    ----------
    analysis : Analysis
    note : str, optional
        Shown under the title, e.g. that the record is synthetic; added automatically if the record states that itself.
    fitted : FittedDrop, optional
        The model fitted to this drop, with its agreement with the record, forces and stresses.
    """
    attributes = analysis.record.attrs
    if not note and is_synthetic(attributes):
        note = synthetic_note(1)
    when = moment(str(attributes["drop_time"])) if attributes.get("drop_time") else ""
    named = (attributes.get("title"), when, attributes.get("source_file"))
    drop = " · ".join(str(part) for part in named if part)
    parts: list[Section | None] = [
        summary.section(analysis, fitted),
        quality.section(analysis),
        release.section(analysis),
        orbit.section(analysis),
        gap.section(analysis),
        contact.section(analysis, fitted is not None),
        agreement.section(fitted) if fitted is not None else None,
        forces.section(fitted) if fitted is not None else None,
        rundown.section(analysis),
        spectra.section(analysis),
        natural_frequencies.section(analysis, fitted) if fitted is not None else None,
        _coast_down(fitted) if fitted is not None else None,
        whirl.section(analysis),
        tracking.section(analysis) if analysis.falls else None,  # else there is no run-down to track
        limits.section(analysis, fitted is not None),
        source.section(analysis),
    ]
    return Document(
        "Dropdown report",
        f"{analysis.machine.name} · {drop}" if drop else analysis.machine.name,
        tuple(part for part in parts if part is not None),
        note=note,
    )


def _coast_down(fitted: FittedDrop) -> Section | None:
    """Return the section on the measured coast-down beside the simulated one; None if it was not simulated."""
    if fitted.coast_down is None:
        return None
    return coast_down.section(fitted.coast_down, fitted.natural_frequencies, fitted.calibration.horizon)
