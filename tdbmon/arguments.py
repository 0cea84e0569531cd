"""Arguments that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

MachineFile = Annotated[Path, typer.Argument(metavar="MACHINE", help="the machine's TOML file")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="F.json", help="write the results as JSON")]
Reports = Annotated[
    list[Path] | None, typer.Option("--report", metavar="F.html|F.pdf", help="write a report; may be given twice")
]
