"""The contract of a file format: one file in `tdbmon.record.formats` each."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, Protocol

from tdbsim.errors import InputError

from tdbmon.record.channel import Content


class Format(Protocol):
    """How files of one kind are known and read.

    `read` may raise any exception on a damaged file: `tdbmon.record.read` turns it into an `InputError` that names
    the file and the format.  It opens and closes the file itself and leaves no lazy handle behind.
    """

    name: str  # as people know the format
    extra: str | None  # the extra of this distribution that installs its library; None in the base install

    def recognises(self, head: bytes, path: Path) -> bool:
        """Tell from the first bytes of the file (at most 4096) whether it is of this format."""

    def read(self, path: Path) -> Content:
        """Return all channels, loaded into memory."""


def library(module: str, reader: Format, path: Path) -> Any:
    """Import the library of an optional format for a file.

    Raises
    ------
    InputError
        If it is not installed, with the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise InputError(
            f"{path}: is a {reader.name} file; to read it run: pip install 'tdbmon[{reader.extra}]'"
        ) from None
