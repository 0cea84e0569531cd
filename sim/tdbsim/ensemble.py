"""Many drops at once: variations of a machine, of effects, of the state at the release."""

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

_FEWEST = 3  # drops that are quicker side by side than one by one


def run_many(cases: Sequence[Case], threads: int | None = None) -> list[Trajectory]:
    """Integrate many drops on several threads, those of one rotor, one step and the same instants eight side by side.

    Each drop takes the steps that `run` would take and is what that gives, to rounding (which grows as neighbouring drops
    part); which drops stand beside it, and how many threads there are, changes no more than that.

    Parameters
    ----------
    cases : sequence of (DropModel, DropPlan)
        A model may stand in several cases; to vary one, change the arrays of its `DropModel.copy`.
    threads : int, optional
        As many as there are processors where not given.

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
    """Return what is seen of many drops, integrated as `run_many` does, or why one cannot be.

    Parameters
    ----------
    cases : sequence of (DropModel, DropPlan)
    seen : callable
        Makes of a trajectory what is kept: states take much room, and only those of one batch a
        thread are there at a time.
    fewest : int
        As many that have all in common go side by side; fewer go one by one.
    threads : int, optional
        As many as there are processors where it is None.
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
    """Return which cases go together."""
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
    """Return how many cores this process may use, which may be fewer than the machine has."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
