"""Who does the work: threads for single drops, and processes for what takes long.

A simulation lets go of Python's lock, what stands around it does not; so threads hardly gain where many simulations are
prepared and judged, and processes do.
"""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from types import TracebackType
from typing import TypeVar

from tdbsim.ensemble import usable_cores

S = TypeVar("S")
T = TypeVar("T")

_THREADS = 2
_MOST_WORKERS = 4
_SHARES = 3  # of the tasks a worker takes at a time, one after the other: some take longer than others


class Crew:
    """Works on many things at a time while it is open; before and after, and where it is sent to, on one after the other.

    Parameters
    ----------
    workers : int
        Processes; with one, the work stays in this process.  Each starts anew and imports the program, so a script that
        asks for more needs the usual ``if __name__ == "__main__":``.
    """

    def __init__(self, workers: int = 1) -> None:
        self._workers = workers
        self._threads: Executor | None = None
        self._processes: Executor | None = None

    def __reduce__(self) -> tuple[type[Crew], tuple[()]]:
        """Return how a copy is made in another process: idle, since that one is part of a crew itself."""
        return Crew, ()

    def __enter__(self) -> Crew:
        """Open it."""
        self._threads = ThreadPoolExecutor(_THREADS)
        if self._workers > 1:
            # spawned, not forked: threads and open files of this process are not theirs
            self._processes = ProcessPoolExecutor(self._workers, get_context("spawn"), attend_parent)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Send everybody home."""
        for each in (self._threads, self._processes):
            if each is not None:
                each.shutdown(cancel_futures=True)
        self._threads = self._processes = None

    def together(self, work: Callable[[S], T], items: Iterable[S]) -> list[T]:
        """Return what a function makes of items, in threads: for short work on what all share."""
        return list(map(work, items) if self._threads is None else self._threads.map(work, items))

    def apart(self, work: Callable[..., T], tasks: Sequence[tuple[object, ...]]) -> list[T]:
        """Return what a function makes of tasks, its arguments, in processes: for long work; everything travels there."""
        if self._processes is None or len(tasks) < 2:
            return [work(*task) for task in tasks]
        chunk = math.ceil(len(tasks) / (self._workers * _SHARES)) if len(tasks) > 2 * self._workers else 1
        return list(self._processes.map(work, *zip(*tasks, strict=True), chunksize=chunk))


def attend_parent() -> None:
    """Leave interrupts to the process that asked for the work, and end with it, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def all_cores() -> int:
    """Return how many workers there are cores for, four at most: each takes a quarter of a gigabyte."""
    return min(usable_cores(), _MOST_WORKERS)
