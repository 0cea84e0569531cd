"""Progress messages of long computations."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[str], None]


def silent(_: str) -> None:
    """Discard the message."""


@contextmanager
def on_terminal() -> Iterator[Progress]:
    """Show the current step if standard error is a terminal; else show nothing."""
    if not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield lambda step: status.update(step)
