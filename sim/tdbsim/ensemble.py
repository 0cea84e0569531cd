"""Many drops in parallel: variations of a machine, of effects, of the state at the release."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.side_by_side import MOST, run_side_by_side, shared
from tdbsim.simulate import DropPlan, Trajectory, run

Case = tuple[DropModel, DropPlan]
T = TypeVar("T")

_FEWEST = 3  # least number of drops that run faster side by side than one by one


def run_many(cases: Sequence[Case], threads: int | None = None) -> list[Trajectory]:
    """Integrate many drops on several threads, up to eight of the same rotor, step and instants side by side.

    Each drop takes the same steps as in `run` and gives the same result to rounding (which grows as neighbouring paths diverge),
    whatever the drops beside it and the number of threads.

    Parameters
    ----------
    cases : sequence of (DropModel, DropPlan)
        A model may occur in several cases; to vary one, change the arrays of its `DropModel.copy`.
    threads : int, optional
        By default the number of processors.

    Returns
    -------
    list of Trajectory
        In the order of the cases.

    Raises
    ------
    InputError
        As `run`, of the first case that fails.
    """
    trajectories = []
    for each in run_each(cases, lambda found: found, _FEWEST, threads):
        if isinstance(each, InputError):
            raise each
        trajectories.append(each)
    return trajectories


def run_each(
    cases: Sequence[Case],
    seen: Callable[[Trajectory], T],
    fewest: int = 2,
    threads: int | None = 1,
) -> list[T | InputError]:
    """Return a function's results on many drops, integrated as by `run_many`, or the InputError of a drop.

    Parameters
    ----------
    cases : sequence of (DropModel, DropPlan)
    seen : callable
        Reduces a trajectory to the result: states need much memory, and only those of one batch per thread are kept at a time.
    fewest : int
        Least number of compatible drops that run side by side; fewer run one by one.
    threads : int, optional
        The number of processors where it is None.
    """

    def done(batch: Sequence[int]) -> list[T | InputError]:
        found = _run_batch([cases[k] for k in batch])
        return [each if isinstance(each, InputError) else seen(each) for each in found]

    batches = _batches(cases, fewest)
    count = min(threads or usable_cores(), len(batches))
    if count < 2:
        all_done = [done(batch) for batch in batches]
    else:
        with ThreadPoolExecutor(count) as pool:
            all_done = list(pool.map(done, batches))
    kept = {
        k: each
        for batch, several in zip(batches, all_done, strict=True)
        for k, each in zip(batch, several, strict=True)
    }
    return [kept[k] for k in range(len(cases))]


def _batches(cases: Sequence[Case], fewest: int) -> list[list[int]]:
    """Return the indices of cases that run together, batch by batch."""
    alike: dict[object, list[int]] = {}
    for k, case in enumerate(cases):
        common = shared(*case)
        alike.setdefault(("alone", k) if common is None else common, []).append(k)
    batches = []
    for several in alike.values():
        for first in range(0, len(several), MOST):
            batch = several[first : first + MOST]
            batches += [batch] if len(batch) >= fewest else [[k] for k in batch]
    return batches


def _run_batch(cases: Sequence[Case]) -> Sequence[Trajectory | InputError]:
    if len(cases) > 1:
        return run_side_by_side(cases)
    try:
        return [run(*cases[0])]
    except InputError as error:
        return [error]


def usable_cores() -> int:
    """Return the number of cores that this process may use, which may be fewer than the computer has."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
