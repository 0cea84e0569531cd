"""A report as PDF (A4), typeset by typst; the same document gives the same bytes."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from tdbmon.atomic import write_bytes
from tdbmon.report.columns import breakable, column_widths
from tdbmon.report.document import Block, Document, Figure, Paragraph, Table, Verdict
from tdbmon.report.typeset import typeset

_TEMPLATE = Path(__file__).parent / "templates" / "report.typ"


def write_pdf(document: Document, path: str | Path) -> None:
    """Write a report as PDF, atomically.

    Raises
    ------
    InputError
        If the path cannot be written.
    """
    write_bytes(Path(path), render_pdf(document))


def render_pdf(document: Document) -> bytes:
    """Return a report as PDF/A-2a with alternative texts.

    Text is passed to typst as JSON data, never as source, so that markup in a name stays text.  The fonts are those shipped
    with matplotlib; no time stamp is written.
    """
    return _set(document, {"pdf_standards": ["a-2a"], "timestamp": 0})


def render_first_page(document: Document) -> bytes:
    """Return the first page as a PNG image of 90 dots per inch."""
    return _set(document, {"format": "png", "ppi": 90.0})


def _set(document: Document, output: dict[str, Any]) -> bytes:
    """Return the typeset PDF, or an image of its first page."""
    import typst
    from matplotlib import get_data_path

    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        source = place / _TEMPLATE.name
        source.write_bytes(_TEMPLATE.read_bytes())
        made: bytes | list[bytes] = typst.compile(
            str(source),
            root=folder,
            font_paths=[str(Path(get_data_path()) / "fonts" / "ttf")],
            ignore_system_fonts=True,
            sys_inputs={"report": typeset(json.dumps(_tree(document, place), allow_nan=False))},
            **output,
        )
    return made[0] if isinstance(made, list) else made


def _tree(document: Document, folder: Path) -> dict[str, Any]:
    sections = [
        {"title": section.title, "blocks": [made for block in section.blocks if (made := _block(block, folder))]}
        for section in document.sections
    ]
    return {
        "title": document.title,
        "subtitle": document.subtitle,
        "note": document.note,
        "made": document.made,
        "sections": sections,
    }


def _block(block: Block, folder: Path) -> dict[str, Any] | None:
    """Return a block as data for typst; None for a block that cannot be printed."""
    if isinstance(block, Paragraph):
        return {"kind": "Paragraph", "text": block.text}
    if isinstance(block, Verdict):
        return {"kind": "Verdict", "text": block.text, "tone": block.tone}
    if isinstance(block, Table):
        return _table(block)
    if isinstance(block, Figure):
        image = block.image
        file = folder / f"{block.name}.{image.kind}"
        file.write_bytes(image.data)
        return {
            "kind": "Figure",
            "file": file.name,
            "width": image.width_mm,
            "caption": block.caption,
            "alt": block.alt,
        }
    return None


def _table(table: Table) -> dict[str, Any]:
    """Return a table as data for typst; a column without a width is as wide as its text."""
    widths = column_widths(table)

    def fitted(cells: tuple[str, ...]) -> list[str]:
        return list(cells) if widths is None else [breakable(*each) for each in zip(cells, widths, strict=True)]

    return {
        "kind": "Table",
        "caption": table.caption,
        "header": fitted(table.header),
        "rows": [{"cells": fitted(row.cells), "tone": row.tone} for row in table.rows],
        "widths": widths or [None] * len(table.header),
    }
