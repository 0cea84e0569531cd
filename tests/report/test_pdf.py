"""The PDF report."""

from __future__ import annotations

import io
import re
from dataclasses import replace

import pytest
from matplotlib.figure import Figure as Drawing
from pypdf import PdfReader

from tdbmon.analysis.result import Analysis
from tdbmon.report import Document, build_report
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table
from tdbmon.report.pdf import render_pdf


def _text(pdf: bytes) -> str:
    return "\n".join(page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages)


def _squeezed(text: str) -> str:
    """Without white space and soft break points, which line breaking moves."""
    return re.sub(r"[\s\u200b]+", "", text)


@pytest.fixture(scope="module")
def pdf(short_report: Document) -> bytes:
    return render_pdf(short_report)


def test_it_is_a_pdf_for_the_archive_in_a4(pdf: bytes) -> None:
    reader = PdfReader(io.BytesIO(pdf))
    assert 5 <= len(reader.pages) <= 16
    for page in reader.pages:
        assert (float(page.mediabox.width), float(page.mediabox.height)) == pytest.approx((595.28, 841.89), abs=0.1)
    assert b"pdfaid:part" in pdf or "pdfaid" in str(reader.xmp_metadata and reader.xmp_metadata.stream.get_data())


def test_it_holds_the_numbers_and_the_provenance(pdf: bytes, short: Analysis) -> None:
    from tdbmon.quantity import words

    text = _squeezed(_text(pdf))
    for end in short.ends.values():
        assert _squeezed(words(end.air_gap)) in text
    assert short.record.attrs["sha256"] in text
    assert "Thisrecordissynthetic." in text


def test_every_page_names_the_machine_and_its_number(pdf: bytes, short: Analysis) -> None:
    pages = PdfReader(io.BytesIO(pdf)).pages
    for number, page in enumerate(pages, start=1):
        text = _squeezed(page.extract_text())
        assert _squeezed(short.machine.name) in text
        assert f"{number}/{len(pages)}" in text


def test_the_same_analysis_gives_the_same_bytes(pdf: bytes, short: Analysis) -> None:
    assert render_pdf(build_report(short, note="This record is synthetic.")) == pdf


def test_markup_in_names_stays_text(hostile: Analysis, hostile_report: Document) -> None:
    text = _squeezed(_text(render_pdf(hostile_report)))
    assert _squeezed(hostile.machine.name) in text
    assert "#sys.inputs*b*_i_@ref" in text


def test_a_table_gives_its_room_to_the_long_words() -> None:
    """The typesetter shares a page evenly among columns that do not fit: reasons became towers beside half-empty names."""
    why = " ".join(f"because{k:02}" for k in range(24))
    cells = ("gap from arc and swing agree with one another", "NDE_A, NDE_B, DE_A, DE_B, speed, keyphasor", why)
    document = Document("d", "s", (Section("a", (Table("t", ("Check", "Channels", "Why"), (Row(cells),)),)),))
    page = PdfReader(io.BytesIO(render_pdf(document))).pages[0]
    lines = [line for line in page.extract_text(extraction_mode="layout").splitlines() if "because" in line]
    assert 1 < len(lines) < 7  # 240 letters


def _page_of(text: str, *blocks: Block) -> int:
    """Number of the page on which a text stands."""
    pages = PdfReader(io.BytesIO(render_pdf(Document("d", "s", (Section("a", blocks),))))).pages
    (found,) = [number for number, page in enumerate(pages, 1) if text in _squeezed(page.extract_text())]
    return found


def _drawn(height_mm: float) -> Figure:
    def draw() -> Drawing:
        drawing = Drawing(figsize=(170 / 25.4, height_mm / 25.4))
        drawing.subplots().plot([0, 1], [0, 1])
        return drawing

    return Figure("figure", "ItsCaption", "alt", draw)


_HALF = tuple(Paragraph("A line.") for _ in range(20))  # with the title some 130 mm of 253


def test_a_figure_that_nearly_fits_a_page_is_drawn_smaller_on_it() -> None:
    assert [_page_of("ItsCaption", *_HALF, _drawn(height)) for height in (100, 130, 190)] == [1, 1, 2]


def test_words_behind_a_figure_for_the_next_page_fill_this_one() -> None:
    after = (Paragraph("Afterwards."), Paragraph("Last."))
    assert [_page_of(text, *_HALF, _drawn(200), *after) for text in ("ItsCaption", "Afterwards", "Last")] == [2, 1, 1]
    # but those of another figure stay behind it
    other = replace(_drawn(200), name="other", caption="Other")
    assert _page_of("Afterwards", *_HALF, other, _drawn(100), Paragraph("Afterwards.")) == 2


def test_a_short_table_is_not_parted_and_a_long_one_fills_the_page() -> None:
    def pages(lines: int, rows: int) -> list[int]:
        cells = [Row((word, "1")) for word in ("FirstRow", *["between"] * (rows - 2), "LastRow")]
        table = Table("ItsCaption", ("What", "Value"), tuple(cells))
        above = [Paragraph("line")] * lines
        return [_page_of(text, *above, table) for text in ("ItsCaption", "FirstRow", "LastRow")]

    found = [pages(lines, 5) for lines in range(36, 48, 2)]
    assert all(len(set(each)) == 1 for each in found)
    assert {each[0] for each in found} == {1, 2}  # it comes to the end of the page, and goes over it
    assert pages(36, 30) == [1, 1, 2]


def test_a_figure_taller_than_a_page_ends_on_it() -> None:
    heights = []

    def visit(text: str, cm: list[float], tm: list[float], *_: object) -> None:
        if "ItsCaption" in text:
            heights.append(cm[3] * tm[5] + cm[5])

    pages = PdfReader(io.BytesIO(render_pdf(Document("d", "s", (Section("a", (_drawn(400),)),))))).pages
    for page in pages:
        page.extract_text(visitor_text=visit)
    (height,) = heights
    assert 20 / 25.4 * 72 <= height < 100  # points above the page's foot: within its margin
