"""Parallel work: threads for single drops, processes for long tasks.

A simulation releases Python's global interpreter lock, the code around it does not.  So threads hardly help where many
simulations are prepared and evaluated; processes do.
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
_SHARES = 3  # chunks of tasks per worker: small enough for an even load, since some tasks take longer than others


class Crew:
    """Runs tasks in parallel while it is open; before, after, and as a copy in a worker process it runs them one by one.

    Parameters
    ----------
    workers : int
        Number of processes; with one, the work stays in this process.  Each worker is spawned and imports the program, so a
        script that asks for more than one needs the usual ``if __name__ == "__main__":``.
    """

    def __init__(self, workers: int = 1) -> None:
        self._workers = workers
        self._threads: Executor | None = None
        self._processes: Executor | None = None

    def __reduce__(self) -> tuple[type[Crew], tuple[()]]:
        """Pickle as a closed crew, since a worker process is part of a crew itself."""
        return Crew, ()

    def __enter__(self) -> Crew:
        """Start threads and processes."""
        self._threads = ThreadPoolExecutor(_THREADS)
        if self._workers > 1:
            # spawned, not forked: a fork would inherit this process's threads and open files
            self._processes = ProcessPoolExecutor(self._workers, get_context("spawn"), attend_parent)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Shut down threads and processes."""
        for each in (self._threads, self._processes):
            if each is not None:
                each.shutdown(cancel_futures=True)
        self._threads = self._processes = None

    def together(self, work: Callable[[S], T], items: Iterable[S]) -> list[T]:
        """Map a function over items in threads: for short work on shared data."""
        return list(map(work, items) if self._threads is None else self._threads.map(work, items))

    def apart(self, work: Callable[..., T], tasks: Sequence[tuple[object, ...]]) -> list[T]:
        """Map a function over tasks (tuples of arguments) in processes: for long work, as arguments and results are pickled."""
        if self._processes is None or len(tasks) < 2:
            return [work(*task) for task in tasks]
        chunk = math.ceil(len(tasks) / (self._workers * _SHARES)) if len(tasks) > 2 * self._workers else 1
        return list(self._processes.map(work, *zip(*tasks, strict=True), chunksize=chunk))


def attend_parent() -> None:
    """Ignore interrupts, which the parent process handles, and exit with the parent however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def all_cores() -> int:
    """Return the number of workers for the usable cores, four at most: each takes a quarter of a gigabyte."""
    return min(usable_cores(), _MOST_WORKERS)
