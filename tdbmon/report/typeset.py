"""Units as they are printed: checks and reasons have them as a terminal and the JSON do."""

from __future__ import annotations

import re

_PRINTED = {"um": "µm", "us": "µs", "m/s2": "m/s²", "m/s^2": "m/s²", "kg m^2": "kg m²"}
_AFTER_A_NUMBER = re.compile(r"(?<=[\d)] )(um|us|m/s2|m/s\^2|kg m\^2)\b")


def typeset(text: str) -> str:
    """Return words in which units that follow a number are printed: ``25 µm`` for ``25 um``."""
    return _AFTER_A_NUMBER.sub(lambda found: _PRINTED[found[0]], text)
