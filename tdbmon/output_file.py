"""Check of a command's output files before anything is computed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tdbsim.errors import InputError

from tdbmon.atomic import check_writable


def check_outputs(outputs: Iterable[Path | None], inputs: Iterable[Path | None]) -> None:
    """Check that results can be written without overwriting each other or an input.

    Parameters
    ----------
    outputs : iterable of Path or None
        Files to write; None for outputs not requested.
    inputs : iterable of Path or None
        Files that the command reads.

    Raises
    ------
    InputError
        If a folder does not exist, a path is a folder or cannot be written, two outputs are the same file, or an output is an
        input: an overwritten record cannot be measured again.
    """
    read = [each for each in inputs if each is not None and each.exists()]
    seen: set[Path] = set()
    for path in outputs:
        if path is None:
            continue
        if not path.parent.is_dir():
            raise InputError(f"{path}: the folder {path.parent} does not exist; create it first")
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file in it")
        if path.exists() and any(path.samefile(each) for each in read):
            raise InputError(f"{path}: is a file that this command reads; name another file, so that it is not overwritten")
        if path.resolve() in seen:
            raise InputError(f"{path}: is given for two results; name two files")
        seen.add(path.resolve())
        check_writable(path)
