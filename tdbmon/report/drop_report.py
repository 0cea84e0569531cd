"""The report of one analysed drop."""

from __future__ import annotations

from tdbmon import __version__
from tdbmon.analysis.result import Analysis
from tdbmon.report.document import Document
from tdbmon.report.quantity import moment
from tdbmon.report.sections import (
    contact,
    gap,
    limits,
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

_SECTIONS = (summary, quality, release, orbit, gap, contact, rundown, spectra, whirl, tracking, limits, source)


def build_report(analysis: Analysis, note: str = "") -> Document:
    """Return the report of a drop as a document; `write_html` and `write_pdf` write it.

    Parameters
    ----------
    analysis : Analysis
    note : str, optional
        Said under the title, e.g. that the record is synthetic.  A record that says so itself needs none.
    """
    attributes = analysis.record.attrs
    if not note and attributes.get("synthetic"):
        note = "The record is synthetic: it was computed, not measured."
    when = moment(str(attributes["drop_time"])) if attributes.get("drop_time") else ""
    parts = (attributes.get("title"), when, attributes.get("source_file"))
    drop = " · ".join(str(part) for part in parts if part)
    sections = tuple(made for part in _SECTIONS if (made := part.section(analysis)) is not None)
    return Document(
        "Dropdown report",
        f"{analysis.machine.name} · {drop}" if drop else analysis.machine.name,
        sections,
        note=note,
        made=f"tdbmon {__version__}",
    )
