"""Putting a file into the archive: it is there whole or not at all, whatever moment the power fails."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tdbsim.errors import InputError

from tdbmon.atomic import whole

INCOMING = "incoming"  # beside the final places, on the same disk, so that a rename moves a file whole


def put(archive: Path, target: Path, write: Callable[[Path], object]) -> None:
    """Write a file into `incoming`, force it to the disk, and rename it to its place.

    Raises
    ------
    InputError
        If the disk is full or the place cannot be written; nothing has changed then.
    """
    with writable(archive):
        incoming = archive / INCOMING
        incoming.mkdir(exist_ok=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        with whole(target, incoming, forced=True) as part:
            write(part)


def sweep(archive: Path) -> None:
    """Remove what writers that were killed left in `incoming`; to be called by the one writer that holds the lock."""
    for left in (archive / INCOMING).glob("*"):
        left.unlink(missing_ok=True)


@contextmanager
def writable(archive: Path) -> Iterator[None]:
    """Tell an operating system's refusal to write in the archive as an `InputError`."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            said = "the disk is full; nothing of this drop was filed: free some room and add it again"
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            said = "the archive cannot be written; nothing of this drop was filed: get write permission to the folder"
        else:
            said = f"the archive cannot be written ({error.strerror or error}); nothing of this drop was filed"
        raise InputError(f"{archive}: {said}") from None
