"""The JSON file that a command writes in addition to its printed output."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def write_json(path: Path | None, content: dict[str, Any]) -> list[str]:
    """Write a command's results as JSON if a path is given; return the lines to print about it.

    Call it before printing the results: a reader of the output may close the pipe after one line.
    """
    if path is None:
        return []
    from tdbmon.atomic import write_text

    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")
    return [f"json: {path}"]


def say(lines: Iterable[str]) -> None:
    """Print the lines of a command's output."""
    import typer

    for line in lines:
        typer.echo(line)
