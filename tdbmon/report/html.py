"""A report as one self-contained HTML file: no network access, no script but its own."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tdbmon.atomic import write_text
from tdbmon.report.document import Document, Figure, Image, SignalViewer
from tdbmon.report.svg import inline_svg
from tdbmon.report.typeset import typeset

if TYPE_CHECKING:
    from markupsafe import Markup

_MARKS = re.compile(r"(?<=\S{8}[-_./])(?=\S{8})")  # break points within a long word, after punctuation
TEMPLATES = Path(__file__).parent / "templates"


def write_html(document: Document, path: str | Path) -> None:
    """Write a report as a self-contained HTML file, atomically.

    Raises
    ------
    InputError
        If the path cannot be written.
    """
    write_text(Path(path), render_html(document))


def render_html(document: Document) -> str:
    """Return a report as HTML text.

    All text of the document is escaped.  A content security policy allows the page's own style sheet and script by
    their hashes, embedded images, and nothing else.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: typeset(value) if type(value) is str else value,
    )
    style = (TEMPLATES / "report.css").read_text(encoding="utf-8")
    viewers = any(isinstance(block, SignalViewer) for section in document.sections for block in section.blocks)
    script = (TEMPLATES / "viewer.js").read_text(encoding="utf-8") if viewers else ""
    return environment.get_template("report.html").render(
        document=document,
        style=_verbatim(style),
        script=_verbatim(script),
        policy=_policy(style, script),
        kind=lambda block: type(block).__name__,
        picture=_picture,
        breakable=_breakable,
        data=lambda viewer: _json(viewer.signals.packed()),
    )


def _policy(style: str, script: str) -> str:
    allowed = [f"style-src {_hash(style)}", "img-src data:", "base-uri 'none'", "form-action 'none'"]
    if script:
        allowed.append(f"script-src {_hash(script)}")
    return "; ".join(["default-src 'none'", *allowed])


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode('utf-8')).digest()).decode()}'"


def _verbatim(text: str) -> Markup:
    from markupsafe import Markup

    return Markup(text)  # our own style sheet and script; nothing from a file is in them


def _json(data: Any) -> Markup:
    """Return JSON with markup characters escaped, so that it cannot close the script element that contains it."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return _verbatim(text)


def _breakable(text: str) -> Markup:
    """Return a cell whose long names may break after punctuation, so that they do not push other columns out of view."""
    from markupsafe import Markup

    return Markup("<wbr>").join(_MARKS.split(typeset(text)))


def _picture(figure: Figure) -> Markup:
    from markupsafe import Markup

    image: Image = figure.image
    if image.kind == "svg":
        return Markup(inline_svg(image.data, figure.name, figure.alt))
    source = base64.b64encode(image.data).decode()
    return Markup('<img src="data:image/png;base64,{}" alt="{}">').format(source, figure.alt)
