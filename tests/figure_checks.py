"""What every figure of every report must do: name its axes with their units, stay on its page, cover nothing of its own.

Figures are taken from the documents, so that one that is added to a section is looked at with the others.
"""

from __future__ import annotations

import itertools
import re

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing
from matplotlib.text import Text

from tdbmon.report.document import Document, Figure

_UNIT = r"\[.+\]|^drop$|standard errors"  # or what is counted


def figures_of(document: Document) -> list[Figure]:
    """All figures of a report, in order."""
    return [block for section in document.sections for block in section.blocks if isinstance(block, Figure)]


def rendered(drawing: Drawing) -> Drawing:
    FigureCanvasAgg(drawing).draw()
    return drawing


def texts(part: Drawing | Axes) -> str:
    return "\n".join(text.get_text() for text in part.findobj(Text))


def assert_readable(document: Document) -> None:
    """Every figure of a report has alternative words and a caption, and is found without fault."""
    figures = figures_of(document)
    assert figures
    assert all(figure.alt and figure.caption for figure in figures)
    assert len({figure.name for figure in figures}) == len(figures)
    found = {figure.name: faults(figure.draw()) for figure in figures}
    assert not any(found.values()), found


def faults(drawing: Drawing) -> list[str]:
    """Say what is wrong with a figure."""
    rendered(drawing)
    return [*_without_unit(drawing), *_cut_off(drawing), *_covered(drawing), *_markup(drawing)]


def _without_unit(drawing: Drawing) -> list[str]:
    """Axes with numbers whose label has no unit; the axes of a row or a column may say it once."""
    axes, found = _shown(drawing), []
    for ax in axes:
        if ax.get_label() == "<colorbar>":
            labels = [ax.get_ylabel() or ax.get_xlabel()]
        else:
            row = [other for other in axes if other.bbox.y0 < ax.bbox.y1 and ax.bbox.y0 < other.bbox.y1]
            column = [other for other in axes if other.bbox.x0 < ax.bbox.x1 and ax.bbox.x0 < other.bbox.x1]
            labels = []
            if _has_numbers(ax.get_xticklabels()):
                labels.append(ax.get_xlabel() or max((other.get_xlabel() for other in column), key=len))
            if _has_numbers(ax.get_yticklabels()):
                labels.append(ax.get_ylabel() or max((_upright(other) for other in row), key=len))
        found += [f"'{label}' has no unit" for label in labels if not re.search(_UNIT, label)]
    return found


def _upright(ax: Axes) -> str:
    return "" if ax.get_label() == "<colorbar>" else ax.get_ylabel()


def _has_numbers(labels: list[Text]) -> bool:
    """False along an axis that names things, or says nothing."""
    return any(re.fullmatch(r"[-−+\d.,×^⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", label.get_text()) for label in labels if label.get_visible())


def _cut_off(drawing: Drawing) -> list[str]:
    box, (width, height) = drawing.get_tightbbox(drawing.canvas.get_renderer()), drawing.get_size_inches()  # type: ignore[attr-defined]
    inside = box.x0 > -0.01 and box.y0 > -0.01 and box.x1 < width + 0.01 and box.y1 < height + 0.01
    return [] if inside else [f"reaches over its edge: {box}"]


def _covered(drawing: Drawing) -> list[str]:
    """Axes with their labels, legends and words that lie on each other."""
    renderer = drawing.canvas.get_renderer()  # type: ignore[attr-defined]
    parts = [*_shown(drawing), *drawing.legends, *drawing.texts]
    boxes = [part.get_tightbbox(renderer).padded(-1.5) for part in parts]
    pairs = itertools.combinations(zip(parts, boxes, strict=True), 2)
    return [f"{one} covers {other}" for (one, a), (other, b) in pairs if a.overlaps(b)]


def _markup(drawing: Drawing) -> list[str]:
    return ["shows markup of mathematics"] if "mathdefault" in texts(drawing) else []


def _shown(drawing: Drawing) -> list[Axes]:
    return [ax for ax in drawing.axes if ax.get_visible() and ax.axison]
