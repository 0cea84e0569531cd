"""What holds for the project as a whole."""

from __future__ import annotations

import ast
import hashlib
import json
from pathlib import Path

import tdbsim

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
