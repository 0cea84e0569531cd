"""The interface of a file format; each format is one module in `tdbmon.record.formats`."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, Protocol

from tdbsim.errors import InputError

from tdbmon.record.channel import Content


class Format(Protocol):
    """How files of one format are recognised and read.

    `read` may raise any exception on a damaged file: `tdbmon.record.read` converts it to an `InputError` that names
    the file and the format.  It opens and closes the file itself and leaves no lazily loaded handle open.
    """

    name: str  # common name of the format
    extra: str | None  # optional dependency group that installs its library; None if in the base install

    def recognises(self, head: bytes, path: Path) -> bool:
        """Tell from the first bytes of the file (at most 4096) whether it is of this format."""

    def read(self, path: Path) -> Content:
        """Return all channels, loaded into memory."""


def library(module: str, reader: Format, path: Path) -> Any:
    """Import and return the library that an optional format needs to read a file.

    Raises
    ------
    InputError
        If it is not installed; the message gives the install command.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise InputError(
            f"{path}: is in {reader.name} format; to read it run: pip install 'tdbmon[{reader.extra}]'"
        ) from None
