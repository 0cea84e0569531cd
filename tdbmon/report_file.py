"""Writing of the requested report files; the suffix decides the format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tdbmon.json_file import say
from tdbmon.progress import Progress, on_terminal

if TYPE_CHECKING:
    from tdbmon.report.document import Document


def check_reports(paths: Sequence[Path] | None) -> None:
    """Check the suffixes of report paths before anything is computed.

    Raises
    ------
    InputError
        If a path is neither .html nor .pdf.
    """
    from tdbsim.errors import InputError

    for path in paths or ():
        if (suffix := path.suffix.lower()) not in (".html", ".pdf"):
            name = path.with_suffix(".html").name
            raise InputError(f"{path}: a report must be .html or .pdf, not '{suffix}'; name it {name}")


def draw_reports(paths: Sequence[Path] | None, make: Callable[[Progress], Document]) -> None:
    """Draw and write the requested reports; call it after the results are printed, since a figure may fail."""
    if not paths:
        return
    with on_terminal() as tell:
        document = make(tell)
        tell("drawing the figures")
        for path in paths:
            _write(document, path)
    say(f"report: {path}" for path in paths)


def _write(document: Document, path: Path) -> None:
    if path.suffix.lower() == ".html":
        from tdbmon.report.html import write_html

        write_html(document, path)
    else:
        from tdbmon.report.pdf import write_pdf

        write_pdf(document, path)
