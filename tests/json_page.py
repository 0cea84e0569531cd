"""What docs/json.md says that a command's JSON has."""

from __future__ import annotations

import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "json.md"


def documented(command: str) -> set[str]:
    """Return the keys in the table of a command."""
    _, _, rest = PAGE.read_text(encoding="utf-8").partition(f"\n## `tdbmon {command}`\n")
    rows = re.findall(r"^\| (`.*?) \|", rest.partition("\n## ")[0], re.MULTILINE)
    return {key for row in rows for key in re.findall(r"`(\w+)`", row)}
