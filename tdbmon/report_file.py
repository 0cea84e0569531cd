"""The report files that a command was asked for: the suffix decides the form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tdbmon.json_file import say
from tdbmon.progress import on_terminal

if TYPE_CHECKING:
    from tdbmon.report.document import Document

ReportWriter = Callable[["Document"], None]


def report_writers(paths: Sequence[Path] | None) -> list[ReportWriter]:
    """Return what writes a document to each path; wrong paths are told before anything is computed.

    Raises
    ------
    InputError
        If a path is neither .html nor .pdf.
    """
    return [_writer(path) for path in paths or ()]


def draw_reports(paths: Sequence[Path] | None, writers: Sequence[ReportWriter], make: Callable[[], Document]) -> None:
    """Draw and write the reports that a command was asked for, once what it found is said: a figure may fail."""
    if not writers:
        return
    with on_terminal() as tell:
        tell("drawing the figures")
        document = make()
        for write in writers:
            write(document)
    say(f"report: {path}" for path in paths or [])


def _writer(path: Path) -> ReportWriter:
    from tdbsim.errors import InputError

    suffix = path.suffix.lower()
    if suffix not in (".html", ".pdf"):
        raise InputError(f"{path}: a report is .html or .pdf, not '{suffix}'; name it {path.with_suffix('.html').name}")

    def write(document: Document) -> None:
        if suffix == ".html":
            from tdbmon.report.html import write_html

            write_html(document, path)
        else:
            from tdbmon.report.pdf import write_pdf

            write_pdf(document, path)

    return write
