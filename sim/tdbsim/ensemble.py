"""Many drops at once: variations of a machine, of effects, of the state at the release."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.side_by_side import MOST, run_side_by_side, shared
from tdbsim.simulate import DropPlan, Trajectory, run

Case = tuple[DropModel, DropPlan]

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
    batches = _batches(cases)
    count = min(threads or usable_cores(), len(batches))
    if count < 2:
        done = [_run_batch([cases[k] for k in batch]) for batch in batches]
    else:
        with ThreadPoolExecutor(count) as pool:
            done = list(pool.map(lambda batch: _run_batch([cases[k] for k in batch]), batches))
    found = {
        k: each for batch, several in zip(batches, done, strict=True) for k, each in zip(batch, several, strict=True)
    }
    trajectories = []
    for k in range(len(cases)):
        each = found[k]
        if isinstance(each, InputError):
            raise each
        trajectories.append(each)
    return trajectories


def _batches(cases: Sequence[Case]) -> list[list[int]]:
    """Return which cases go together."""
    alike: dict[object, list[int]] = {}
    for k, case in enumerate(cases):
        common = shared(*case)
        alike.setdefault(("alone", k) if common is None else common, []).append(k)
    batches = []
    for several in alike.values():
        for first in range(0, len(several), MOST):
            batch = several[first : first + MOST]
            batches += [batch] if len(batch) >= _FEWEST else [[k] for k in batch]
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
