"""What holds for the project as a whole."""

from __future__ import annotations

import ast
import hashlib
import json
import re
from pathlib import Path

import pytest
import tdbsim

from tdbmon import effects_page, machine_page
from tdbmon.identify.model_share import FORCES_HOLD
from tdbmon.shipped import shipped


def test_the_simulator_knows_nothing_of_tdbmon():
    files = list(Path(tdbsim.__file__).parent.rglob("*.py"))
    assert len(files) > 20
    for file in files:
        for node in ast.walk(ast.parse(file.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            assert not any(name.split(".")[0] == "tdbmon" for name in names), file


def test_shipped_files_are_those_of_the_manifest():
    manifest = json.loads(shipped("manifest.json").read_text())["files"]
    root = shipped("manifest.json").parent
    assert {str(f.relative_to(root)) for f in root.glob("*/*") if f.is_file()} == set(manifest)
    for name, entry in manifest.items():
        assert hashlib.sha256((root / name).read_bytes()).hexdigest() == entry["sha256"], name
        assert entry["kind"] in ("synthetic", "measured")
        assert entry["licence"]
        assert entry["origin"]


def test_the_page_of_effects_says_what_they_declare():
    shown = effects_page.PAGE.read_text(encoding="utf-8")
    assert shown == effects_page.render(), "remake it: python -m tdbmon.effects_page"


def test_the_page_of_machine_files_says_what_the_models_read():
    shown = machine_page.PAGE.read_text(encoding="utf-8")
    assert shown == machine_page.render(), "remake it: python -m tdbmon.machine_page"


ROOT = Path(__file__).parents[1]


@pytest.mark.skipif(not (ROOT / "demo-output").is_dir(), reason="make demo was not run")
@pytest.mark.parametrize("name", ["drop_100", "drop_150", "comparison", "machine", "diagnosis"])
def test_the_reports_that_the_readme_shows_are_as_the_demo_makes_them(name: str):
    """Headings, captions of tables, heads of columns, names of figures.

    Numbers and how many contacts there are differ from computer to computer.
    """
    shown, made = (_skeleton(folder / f"{name}.html") for folder in (ROOT / "reports", ROOT / "demo-output"))
    assert len(made) > 10
    assert shown == made, "make reports, and look at them"


def _skeleton(page: Path) -> list[str]:
    found = re.findall(r'<(?:h2|caption|th scope="col")[^>]*>(.*?)</(?:h2|caption|th)>', page.read_text(), re.DOTALL)
    found += re.findall(r'<figure id="([^"]*)"', page.read_text())
    return [re.sub(r"[-−\d.,]+", "#", re.sub(r"; \d+ more (is|are) left out", "", text)) for text in found]


def _counted(page: str, row: str) -> tuple[int, int]:
    """Sum what a page's tables have in the rows that begin so, as 'reached of all'."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    found = re.findall(rf"^\| (?:{row}) \|(?:[^|\n]*\|)?? (\d+)/(\d+) = ", text, re.MULTILINE)
    assert found, row
    return sum(int(reached) for reached, _ in found), sum(int(of) for _, of in found)


def test_the_readme_counts_as_the_pages_do_that_it_points_to():
    readme = re.sub(r"\s+", " ", (ROOT / "README.md").read_text(encoding="utf-8"))
    near, all_ = _counted("fitted_forces.md", "peak force within 5 %")
    inside, _ = _counted("fitted_forces.md", "interval of the peak force contains the true value")
    assert f"{near} of {all_} peak forces lie within 5 % of the truth and {inside} within their intervals" in readme
    right, cases = _counted("blind.md", "nothing hidden|one effect|two effects at once|outside the catalogue")
    assert f"of the last {cases} of them {right}" in readme


def test_what_is_said_of_the_intervals_of_forces_is_what_the_pages_count():
    """Numbers in words go stale when the fit changes: true | stated | off by | inside, in the tables of peak forces."""
    inside, all_ = _counted("fitted_forces.md", "interval of the peak force contains the true value")
    page = (ROOT / "docs" / "forces.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \w+ \| \w+ \| \d+ N \|[^|]*\| ([+-][\d.]+) % \| (yes|\*\*no\*\*) \|", page, re.MULTILINE)
    outside = sorted(float(off) for off, held in rows if held != "yes")
    assert len(rows) > len(outside) > 1 and outside[0] > 0
    assert f"{inside} of {all_} did (docs/fitted_forces.md)" in FORCES_HOLD
    assert f"{len(rows) - len(outside)} of {len(rows)} (docs/forces.md)" in FORCES_HOLD
    assert f"the other {len(outside)} of these were stated {outside[0]} to {outside[-1]} % too high" in FORCES_HOLD
