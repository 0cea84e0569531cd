"""Many drops at once: variations of a machine, of effects, of the state at the release."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from tdbsim.drop_model import DropModel
from tdbsim.simulate import DropPlan, Trajectory, run


def run_many(cases: Sequence[tuple[DropModel, DropPlan]], threads: int | None = None) -> list[Trajectory]:
    """Integrate many drops on several threads; the kernels run side by side, each drop as `run` alone would give it.

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
    count = threads or usable_cores()
    if count == 1 or len(cases) < 2:
        return [run(model, plan) for model, plan in cases]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(lambda case: run(*case), cases))


def usable_cores() -> int:
    """Return how many cores this process may use, which may be fewer than the machine has."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
