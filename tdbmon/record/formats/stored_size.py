"""How much a file says that it holds, beside how much it can."""

from __future__ import annotations

from pathlib import Path

from tdbsim.errors import InputError


def check_size(stored: int, path: Path, compressed: bool) -> None:
    """Refuse a file whose header promises more than it can hold: cut off, or damaged so that memory would run out.

    Raises
    ------
    InputError
        If `stored` bytes of values cannot come out of the file; zlib shrinks to a thousandth at best.
    """
    size = path.stat().st_size
    if stored > (2000 * size if compressed else size):
        raise InputError(
            f"{path}: its header promises {stored / 1e6:.3g} MB of values, the file has {size / 1e6:.3g} MB;"
            " it is damaged or cut off: export it again"
        )
