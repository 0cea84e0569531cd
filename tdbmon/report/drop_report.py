"""The report of one analysed drop."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING

from tdbmon import __version__
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

_SECTIONS = (summary, quality, release, orbit, gap, contact, rundown, spectra, whirl, tracking, limits, source)


def build_report(analysis: Analysis, note: str = "", fitted: FittedDrop | None = None) -> Document:
    """Return the report of a drop as a document; `write_html` and `write_pdf` write it.

    Parameters
    ----------
    analysis : Analysis
    note : str, optional
        Said under the title, e.g. that the record is synthetic.  A record that says so itself needs none.
    fitted : FittedDrop, optional
        The model fitted to this drop: how far it follows the record, forces, stresses.
    """
    attributes = analysis.record.attrs
    if not note and is_synthetic(attributes):
        note = synthetic_note(1)
    when = moment(str(attributes["drop_time"])) if attributes.get("drop_time") else ""
    parts = (attributes.get("title"), when, attributes.get("source_file"))
    drop = " · ".join(str(part) for part in parts if part)
    sections = []
    for part in _SECTIONS:
        if part is summary:
            made = summary.section(analysis, fitted)
        elif part is tracking and not analysis.falls:
            continue  # no run-down to follow
        elif part in (contact, limits):
            made = part.section(analysis, fitted is not None)
        else:
            made = part.section(analysis)
        if made is not None:
            sections.append(made)
        if fitted is not None:
            sections += _of_model(part, analysis, fitted)
    return Document(
        "Dropdown report",
        f"{analysis.machine.name} · {drop}" if drop else analysis.machine.name,
        tuple(sections),
        note=note,
        made=f"tdbmon {__version__}",
    )


def _of_model(after: ModuleType, analysis: Analysis, fitted: FittedDrop) -> list[Section]:
    """Return the sections of the fitted model that follow one of the record alone."""
    if after is contact:
        return [agreement.section(fitted), forces.section(fitted)]
    if after is spectra:
        found = [natural_frequencies.section(analysis, fitted)]
        if fitted.coast_down is not None:
            modes, horizon = fitted.natural_frequencies, fitted.calibration.horizon
            found.append(coast_down.section(fitted.coast_down, modes, horizon))
        return found
    return []
