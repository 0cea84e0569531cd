"""The page in a true browser: the viewer works, nothing is requested, nothing hostile runs."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tdbmon.analysis.result import Analysis
from tdbmon.report import Document, write_html

sys.path.insert(0, str(Path(__file__).parent))
from chromium import Page, find_chromium

BINARY = find_chromium()
pytestmark = [pytest.mark.browser, pytest.mark.skipif(BINARY is None, reason="no Chromium is installed")]

SHOWN = "document.querySelector('.viewer output').textContent"


@pytest.fixture(scope="module")
def opened(coastdown_report: Document, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    yield from _opened(coastdown_report, tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="module")
def opened_hostile(hostile_report: Document, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    yield from _opened(hostile_report, tmp_path_factory.mktemp("hostile"))


def _opened(document: Document, folder: Path) -> Iterator[Page]:
    path = folder / "report.html"
    write_html(document, path)
    assert BINARY is not None
    with Page(BINARY, folder / "profile", path.as_uri()) as page:
        yield page


def _range(page: Page) -> tuple[float, float]:
    start, end = re.findall(r"(\d+\.\d+) s", page.value(SHOWN))
    return float(start), float(end)


def _whole(page: Page) -> tuple[float, float]:
    page.value("document.querySelector('.viewer [data-do=all]').click()")
    return _range(page)


def _canvas(page: Page) -> tuple[float, float, float, float]:
    script = "(() => { const c = document.querySelector('.viewer canvas'); c.scrollIntoView({block: 'center'});"
    script += " const r = c.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()"
    left, top, width, height = page.value(script)
    return left, top, width, height


def test_the_page_asks_for_nothing_and_complains_of_nothing(opened: Page) -> None:
    assert opened.console == []
    assert [url for url in opened.requested if not url.startswith(("file:///", "data:image/png"))] == []
    assert len([url for url in opened.requested if url.startswith("file:")]) == 1


def test_the_whole_record_is_shown_first(opened: Page, coastdown: Analysis) -> None:
    assert coastdown.planes is not None
    start, end = _whole(opened)
    assert start == 0.0
    assert end == pytest.approx(float(coastdown.planes.time[-1]), abs=0.05)


def test_the_wheel_zooms_about_the_pointer(opened: Page) -> None:
    start, end = _whole(opened)
    left, top, width, height = _canvas(opened)
    x = left + 0.5 * width
    time = start + (x - left - 64) / (width - 74) * (end - start)
    for _ in range(4):
        opened.mouse("mouseWheel", x, top + height / 3, deltaX=0, deltaY=-240)
    near = _range(opened)
    assert near[1] - near[0] < 0.4 * (end - start)
    again = near[0] + (x - left - 64) / (width - 74) * (near[1] - near[0])
    assert again == pytest.approx(time, abs=0.02 * (end - start))
    for _ in range(4):
        opened.mouse("mouseWheel", x, top + height / 3, deltaX=0, deltaY=240)
    assert _range(opened) == pytest.approx((start, end), abs=0.5)


def test_dragging_moves_and_a_double_click_shows_all(opened: Page) -> None:
    whole = _whole(opened)
    left, top, width, height = _canvas(opened)
    opened.value("document.querySelector('.viewer [data-do=in]').click()")
    before = _range(opened)
    y = top + height / 3
    opened.mouse("mousePressed", left + 500, y, button="left", clickCount=1)
    opened.mouse("mouseMoved", left + 300, y, button="left", buttons=1)
    opened.mouse("mouseReleased", left + 300, y, button="left", clickCount=1)
    after = _range(opened)
    shift = 200 / (width - 74) * (before[1] - before[0])
    assert after[0] - before[0] == pytest.approx(shift, abs=0.05)
    assert after[1] - after[0] == pytest.approx(before[1] - before[0], abs=0.05)
    for count in (1, 2):
        opened.mouse("mousePressed", left + 400, y, button="left", clickCount=count)
        opened.mouse("mouseReleased", left + 400, y, button="left", clickCount=count)
    assert _range(opened) == whole


def test_the_keyboard_does_the_same(opened: Page) -> None:
    whole = _whole(opened)
    opened.value("document.querySelector('.viewer canvas').focus()")
    opened.key("+")
    near = _range(opened)
    assert near[1] - near[0] == pytest.approx((whole[1] - whole[0]) / 2, abs=0.1)
    opened.key("ArrowRight")
    assert _range(opened)[0] - near[0] == pytest.approx((near[1] - near[0]) / 10, abs=0.1)
    opened.key("Home")
    assert _range(opened) == whole


def _ink(page: Page) -> int:
    """Pixels of the first channel's colour on the canvas."""
    script = """(() => { const c = document.querySelector('.viewer canvas');
      const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;
      for (let i = 0; i < d.length; i += 4) if (d[i] === 0 && d[i+1] === 0x72 && d[i+2] === 0xB2) n++;
      return n; })()"""
    return int(page.value(script))


def test_signals_are_drawn_and_can_be_taken_away(opened: Page) -> None:
    _whole(opened)
    drawn = _ink(opened)
    assert drawn > 200
    boxes = "document.querySelectorAll('.viewer input')"
    opened.value(f"{boxes}.forEach(box => box.click())")
    assert _ink(opened) == 0
    opened.value(f"{boxes}.forEach(box => box.click())")
    assert _ink(opened) == drawn


def test_hostile_names_stay_text(opened_hostile: Page, hostile: Analysis) -> None:
    assert opened_hostile.console == []
    assert opened_hostile.value("document.querySelectorAll('script').length") == 2
    assert opened_hostile.value("document.querySelectorAll('b, i').length") == 0
    legend = opened_hostile.value("document.querySelector('.viewer .legend').textContent")
    assert f"{hostile.ends[next(iter(hostile.ends))].name} x" in legend
    assert hostile.machine.name in opened_hostile.value("document.querySelector('.note').textContent")
    assert hostile.machine.name in opened_hostile.value(
        "document.querySelector('svg text') && document.body.textContent"
    )
    assert [url for url in opened_hostile.requested if not url.startswith(("file:///", "data:image/png"))] == []


def test_nothing_is_wider_than_the_window(opened: Page) -> None:
    assert opened.value("document.documentElement.scrollWidth <= window.innerWidth")
