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
    temporary = None
    try:
        if path.exists() and not path.is_file():
            with tempfile.TemporaryDirectory() as folder:
                part = Path(folder) / path.name
                yield part
                with path.open("wb") as stream:
                    stream.write(part.read_bytes())
            return
        path = path.resolve()
        temporary = _begun(path)
        yield temporary
        # a temporary file is private; the result gets the permissions that any new file would
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        os.replace(temporary, path)
    except OSError as error:
        raise _refused(path, error) from None
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


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
        _begun(path.resolve()).unlink()
    except OSError as error:
        raise _refused(path, error) from None


def _begun(path: Path) -> Path:
    """Return a temporary file beside the one that is to be written."""
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=path.suffix)
    os.close(handle)
    return Path(name)


def _refused(path: Path, error: OSError) -> InputError:
    return InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write a text file (UTF-8) whole or not at all."""
    write_bytes(path, text.encode())
