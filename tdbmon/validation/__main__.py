"""Write the validation report: ``python -m tdbmon.validation [FILE]`` (default docs/validation.md)."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from tdbmon.atomic import replacing
from tdbmon.validation import case_study, first_drop, publication_one, publication_two

HEAD = """# Validation against published numbers

Made by `python -m tdbmon.validation` from runs; do not edit. Source: N. Neisi, doctoral dissertation on touchdown bearings
(LUT University), with its Publications I and II. Published numbers and the values in the machine files are inputs;
everything else is computed when this file is made. The machines are in `datasets/machines/`, where each file says what is
printed and what is assumed: the shafts' dimensions are given in figures only. Nothing is tuned to match. Forces and values
fitted to synthetic drops are compared with the true ones in [forces](forces.md) and [fitted forces](fitted_forces.md).
"""


def report() -> str:
    """Return the whole report as Markdown."""
    chapters = (each.chapter() for each in (publication_one, first_drop, publication_two, case_study))
    return "\n".join([HEAD, *chapters])


def main(arguments: Sequence[str]) -> None:
    """Write the report to the given file, by default docs/validation.md."""
    target = Path(arguments[0]) if arguments else Path("docs/validation.md")
    text = report()
    target.parent.mkdir(parents=True, exist_ok=True)
    with replacing(target) as temporary:
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
