"""Files that are either written whole or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tdbsim.errors import InputError


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder; on success it takes the place of `path`, else it is removed.

    A link stays one: what it points to is replaced.  What is no file (a pipe, a terminal) is written to.

    Raises
    ------
    InputError
        If the place cannot be written.
    """
    try:
        if path.exists() and not path.is_file():
            with tempfile.TemporaryDirectory() as folder:
                part = Path(folder) / path.name
                yield part
                with path.open("wb") as stream:
                    stream.write(part.read_bytes())
            return
        path = path.resolve()
        _check_access(path)
        with whole(path, path.parent, _hidden(path)) as temporary:
            yield temporary
    except OSError as error:
        raise _refused(path, error) from None


@contextmanager
def whole(path: Path, folder: Path, prefix: str = "", forced: bool = False) -> Iterator[Path]:
    """Yield a temporary path in a folder of the same disk; on success it takes the place of `path`, else it is removed.

    Parameters
    ----------
    path : Path
    folder : Path
    prefix : str, optional
        Of the temporary file's name.
    forced : bool, optional
        Whether the file is on the disk before it takes its place, and its name after that, whatever moment the power fails.
    """
    part = _temporary(folder, prefix, path.suffix)
    try:
        yield part
        # a temporary file is private; the result gets the permissions that any new file would
        umask = os.umask(0)
        os.umask(umask)
        part.chmod(0o666 & ~umask)
        if forced:
            _to_disk(part)
        os.replace(part, path)
        if forced:
            _to_disk(path.parent)
    finally:
        part.unlink(missing_ok=True)


def check_writable(path: Path) -> None:
    """Begin a file at a place and remove it; what is no file (a pipe, a terminal) is left alone.

    Raises
    ------
    InputError
        If the place cannot be written.
    """
    if path.exists() and not path.is_file():
        return
    try:
        path = path.resolve()
        _check_access(path)
        _temporary(path.parent, _hidden(path), path.suffix).unlink()
    except OSError as error:
        raise _refused(path, error) from None


def _check_access(path: Path) -> None:
    """Refuse to replace a file that may not be written."""
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _hidden(path: Path) -> str:
    return f".{path.name}."


def _temporary(folder: Path, prefix: str, suffix: str) -> Path:
    handle, name = tempfile.mkstemp(dir=folder, prefix=prefix, suffix=suffix)
    os.close(handle)
    return Path(name)


def _to_disk(path: Path) -> None:
    """Force a file, or a folder's list of names, to the disk (folders: where the system can)."""
    if os.name == "nt" and path.is_dir():
        return
    handle = os.open(path, os.O_RDONLY if os.name != "nt" else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _refused(path: Path, error: OSError) -> InputError:
    return InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write a text file (UTF-8) whole or not at all."""
    write_bytes(path, text.encode())
