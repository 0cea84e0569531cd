"""The JSON that a command writes beside what it prints."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def write_json(path: Path | None, content: dict[str, Any]) -> list[str]:
    """Write a command's results, where a file is named, and return what to say of it.

    To be called before results are printed: whoever reads the output may close it after a line.
    """
    if path is None:
        return []
    from tdbmon.atomic import write_text

    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")
    return [f"json: {path}"]


def say(lines: Iterable[str]) -> None:
    """Print what a command found, and what it wrote."""
    import typer

    for line in lines:
        typer.echo(line)
