"""Location of the records and machines that ship with tdbmon."""

from __future__ import annotations

from pathlib import Path


def shipped(name: str) -> Path:
    """Return the path of a shipped file or folder, e.g. ``"coastdown/drop_100.nc"``.

    Raises
    ------
    FileNotFoundError
        If it does not ship.
    """
    here = Path(__file__).resolve().parent
    for root in (here / "datasets", here.parent / "datasets"):
        if (root / name).exists():
            return root / name
    raise FileNotFoundError(f"'{name}' is not shipped with tdbmon")
