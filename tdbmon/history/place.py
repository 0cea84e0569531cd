"""Atomic writing of a file into the archive: complete or not at all, even if the power fails."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tdbsim.errors import InputError

from tdbmon.atomic import whole

INCOMING = "incoming"  # on the same disk as the final paths, so that a rename is atomic


def put(archive: Path, target: Path, write: Callable[[Path], object]) -> None:
    """Write a file into `incoming`, flush it to the disk, and rename it to its final path.

    Raises
    ------
    InputError
        If the disk is full or the path cannot be written; nothing has changed then.
    """
    with writable(archive):
        incoming = archive / INCOMING
        incoming.mkdir(exist_ok=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        with whole(target, incoming, forced=True) as part:
            write(part)


def sweep(archive: Path) -> None:
    """Remove leftovers of killed writers from `incoming`; only to be called by the writer that holds the lock."""
    for left in (archive / INCOMING).glob("*"):
        left.unlink(missing_ok=True)


@contextmanager
def writable(archive: Path) -> Iterator[None]:
    """Turn an operating system's refusal to write in the archive into an `InputError`."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            said = "the disk is full; nothing of this drop was filed: free some space and add it again"
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            said = "the archive cannot be written; nothing of this drop was filed: get write permission for the folder"
        else:
            said = f"the archive cannot be written ({error.strerror or error}); nothing of this drop was filed"
        raise InputError(f"{archive}: {said}") from None
