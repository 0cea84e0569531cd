"""Typographic units for reports; checks and reasons use the ASCII units of terminal and JSON."""

from __future__ import annotations

import re

_PRINTED = {"um": "µm", "us": "µs", "m/s2": "m/s²", "m/s^2": "m/s²", "kg m^2": "kg m²"}
_AFTER_A_NUMBER = re.compile(r"(?<=[\d)] )(um|us|m/s2|m/s\^2|kg m\^2)\b")


def typeset(text: str) -> str:
    """Return a text with units after a number in typographic form: ``25 µm`` for ``25 um``."""
    return _AFTER_A_NUMBER.sub(lambda found: _PRINTED[found[0]], text)
