"""The JSON that a command writes beside what it prints."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def write_json(path: Path | None, content: dict[str, Any]) -> None:
    """Write a command's results, where a file is named, and say so."""
    if path is None:
        return
    import typer

    from tdbmon.atomic import write_text

    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")
    typer.echo(f"json: {path}")
