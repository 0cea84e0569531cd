"""A machine for the tests, and variations of its file."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from tdbsim.machine import Machine, parse_machine

FILE = Path(__file__).with_name("machine.toml")


def machine(**changes: Any) -> Machine:
    """Return the machine of the file beside this one, top-level tables replaced."""
    data = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return parse_machine({**data, **changes})


def with_probe(name: str, **changes: Any) -> Machine:
    """Return the machine with one probe changed."""
    data = tomllib.loads(FILE.read_text(encoding="utf-8"))
    data["probe"] = [{**probe, **changes} if probe["name"] == name else probe for probe in data["probe"]]
    return parse_machine(data)
