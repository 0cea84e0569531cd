"""Plausibility check of the amount of data stated in a file's header."""

from __future__ import annotations

from pathlib import Path

from tdbsim.errors import InputError


def check_size(stored: int, path: Path, compressed: bool) -> None:
    """Reject a file whose header states more data than it can contain: truncated, or damaged so that memory would run out.

    Raises
    ------
    InputError
        If the file cannot contain `stored` bytes of values; zlib compresses to about a thousandth at best.
    """
    size = path.stat().st_size
    if stored > (2000 * size if compressed else size):
        raise InputError(
            f"{path}: its header states {stored / 1e6:.3g} MB of values, but the file has {size / 1e6:.3g} MB;"
            " it is damaged or cut off: export it again"
        )
