"""The HTML report: one file, nothing from elsewhere, nothing from a file taken for markup."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from tdbsim.errors import InputError

from tdbmon.analysis.result import Analysis
from tdbmon.quantity import words
from tdbmon.report import Document, build_report, write_html
from tdbmon.report.html import render_html

VOID = {"meta", "img", "br", "wbr", "input", "link", "hr"}


class Page(HTMLParser):
    """Elements with their attributes and texts; refuses tags that do not match."""

    def __init__(self, source: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.raw: dict[str, list[str]] = {"script": [], "style": []}
        self.text: list[str] = []
        self.feed(source)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag in self.raw:
            self.raw[tag].append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in self.raw:
            self.raw[self.open[-1]][-1] += data
        else:
            self.text.append(data)

    @property
    def policy(self) -> str:
        return next(a["content"] for tag, a in self.elements if a.get("http-equiv") == "Content-Security-Policy")

    def named(self, tag: str) -> list[dict[str, str]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def source(short_report: Document) -> str:
    return render_html(short_report)


@pytest.fixture(scope="module")
def page(source: str) -> Page:
    return Page(source)


@pytest.fixture(scope="module")
def hostile_source(hostile_report: Document) -> str:
    return render_html(hostile_report)


def test_the_page_holds_the_numbers(page: Page, short: Analysis) -> None:
    text = " ".join(page.text)
    for end in short.ends.values():
        assert words(end.air_gap) in text and words(end.stiffness) in text
    assert "This record is synthetic." in text


def test_nothing_is_loaded_from_elsewhere(page: Page) -> None:
    for tag, attributes in page.elements:
        for name, value in attributes.items():
            if name.startswith("xmlns"):
                continue
            assert not re.match(r"(https?:)?//", value.strip()), f"<{tag} {name}={value[:60]!r}>"
            if name in ("src", "href", "xlink:href", "data", "action", "poster", "srcset"):
                assert value.startswith(("data:image/png;base64,", "#")), f"<{tag} {name}={value[:60]!r}>"
    for text in (*page.raw["style"], *page.raw["script"]):
        assert not re.search(r"https?://|@import|url\(", text)
    assert "link" not in {tag for tag, _ in page.elements}


def test_the_policy_allows_the_pages_own_style_and_script_only(page: Page) -> None:
    rules = dict(rule.strip().split(" ", 1) for rule in page.policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert "unsafe" not in page.policy and "*" not in page.policy

    def digest(text: str) -> str:
        return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"

    assert rules["style-src"] == digest(page.raw["style"][0])
    running = [text for text, a in zip(page.raw["script"], page.named("script"), strict=True) if "type" not in a]
    assert [digest(text) for text in running] == [rules["script-src"]]


def test_no_style_or_handler_attribute_that_the_policy_would_block(page: Page) -> None:
    for tag, attributes in page.elements:
        assert not [name for name in attributes if name == "style" or name.startswith("on")], tag


def test_identifiers_are_unique_and_references_lead_somewhere(page: Page) -> None:
    found = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(found) == len(set(found))
    for _, attributes in page.elements:
        for name in ("href", "xlink:href"):
            if attributes.get(name, "").startswith("#"):
                assert attributes[name][1:] in found
        clip = re.fullmatch(r"url\(#(.+)\)", attributes.get("clip-path", ""))
        if clip:
            assert clip.group(1) in found


def test_the_page_can_be_used_without_seeing_it(page: Page) -> None:
    assert page.named("html")[0]["lang"] == "en"
    assert page.named("title") and page.named("main") and page.named("nav")
    assert len(page.named("h1")) == 1
    assert all(attributes.get("alt") for attributes in page.named("img"))
    figures = [attributes for attributes in page.named("svg")]
    assert figures and all(a.get("role") == "img" and a.get("aria-label") for a in figures)
    assert len(page.named("caption")) == len(page.named("table"))
    assert all("scope" in attributes for attributes in page.named("th"))


def test_hostile_names_stay_text_everywhere(hostile_source: str, hostile: Analysis) -> None:
    page = Page(hostile_source)
    name = hostile.machine.name
    assert "<script>alert" not in hostile_source
    assert len(page.named("script")) == 2 and not page.named("b")
    text = "".join(page.text)
    assert name in text
    assert any(f"{name}0" in part for part in page.text), "an end's name, in tables and figures"
    assert name in page.named("html")[0].get("lang", "") + text
    labels = " ".join(attributes.get("aria-label", "") for _, attributes in page.elements)
    assert name in labels


def test_hostile_names_stay_text_in_svg(hostile_source: str, hostile: Analysis) -> None:
    drawn = re.findall(r"<text[^>]*>(.*?)</text>", hostile_source, re.S)
    assert drawn
    titles = [text for text in drawn if "alert(1)" in text]
    assert titles and all("&lt;script&gt;" in text for text in titles)


def test_hostile_names_survive_the_data_of_the_viewer(hostile_source: str, hostile: Analysis) -> None:
    page = Page(hostile_source)
    data = json.loads(next(t for t, a in zip(page.raw["script"], page.named("script"), strict=True) if "type" in a))
    names = [channel["name"] for channel in data["channels"]]
    assert f"{hostile.ends[next(iter(hostile.ends))].name} x" in names


def test_a_whole_drop_is_no_larger_than_one_and_a_half_megabytes(coastdown_report: Document, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    write_html(coastdown_report, path)
    assert path.stat().st_size <= 1_500_000
    assert [entry.name for entry in tmp_path.iterdir()] == ["report.html"]


def test_the_same_analysis_gives_the_same_page(short: Analysis, source: str) -> None:
    assert render_html(build_report(short, note="This record is synthetic.")) == source


def test_a_place_that_cannot_be_written_is_said(short: Analysis, tmp_path: Path) -> None:
    from dataclasses import replace

    document = replace(build_report(short), sections=())
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot be written"):
        write_html(document, tmp_path / "file" / "report.html")
    folder = tmp_path / "folder"
    folder.mkdir()
    with pytest.raises(InputError, match="cannot be written"):
        write_html(document, folder)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "folder"]


def test_an_interrupt_leaves_the_old_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    from tdbmon.atomic import write_bytes

    path = tmp_path / "report.html"
    path.write_text("old")

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_bytes(path, b"new")
    assert path.read_text() == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["report.html"]
