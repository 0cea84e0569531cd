"""Command-line arguments shared by several commands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

MachineFile = Annotated[Path, typer.Argument(metavar="MACHINE", help="the machine's TOML file")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="F.json", help="write the results as JSON")]
Reports = Annotated[
    list[Path] | None, typer.Option("--report", metavar="F.html|F.pdf", help="write a report; may be given twice")
]

_SEVERAL = ("--reference", "--also")  # take all files up to the next option, as a shell expands drop_*.nc


def one_by_one(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with ``--reference A B`` written as ``--reference A --reference B``."""
    out: list[str] = []
    option, alone = "", False
    for argument in [*arguments, "--"]:
        if argument.startswith("-") and alone:
            out.append(option)
        if argument in _SEVERAL:
            option, alone = argument, True
        elif argument.startswith("-"):
            option, alone = "", False
            out.append(argument)
        else:
            out += [option, argument] if option else [argument]
            alone = False
    return out[:-1]
