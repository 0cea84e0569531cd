"""Atomic writing of files: whole or not at all."""

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
    """Yield a temporary path in the same folder; on success it replaces `path`, else it is removed.

    A symbolic link is kept and its target replaced.  Anything but a regular file (a pipe, a terminal) is written to directly.

    Raises
    ------
    InputError
        If the path cannot be written.
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
    """Yield a temporary path in a folder of the same file system; on success it replaces `path`, else it is removed.

    Parameters
    ----------
    path : Path
    folder : Path
    prefix : str, optional
        Prefix of the temporary file's name.
    forced : bool, optional
        Flush the file to disk before the replacement and its directory entry after it, so that a power failure loses neither.
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
    """Check that a path can be written, by creating and removing a file beside it; pipes and terminals are not tested.

    Raises
    ------
    InputError
        If the path cannot be written.
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
    """Raise PermissionError if the file exists and is write-protected."""
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _hidden(path: Path) -> str:
    return f".{path.name}."


def _temporary(folder: Path, prefix: str, suffix: str) -> Path:
    handle, name = tempfile.mkstemp(dir=folder, prefix=prefix, suffix=suffix)
    os.close(handle)
    return Path(name)


def _to_disk(path: Path) -> None:
    """Flush a file, or a folder's directory entries, to disk (folders: not on Windows)."""
    if os.name == "nt" and path.is_dir():
        return
    handle = os.open(path, os.O_RDONLY if os.name != "nt" else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _refused(path: Path, error: OSError) -> InputError:
    return InputError(f"{path}: cannot be written ({error.strerror or error}); choose another folder")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write a text file (UTF-8) whole or not at all."""
    write_bytes(path, text.encode())
