"""Drops of one rotor side by side, up to eight in one kernel (`tdbsim.lanes`)."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from tdbsim import state_layout
from tdbsim.drop_model import Array, Arrays, DropModel
from tdbsim.errors import InputError
from tdbsim.first_use import compile_apart
from tdbsim.integration import check_finite, check_modes, longest_step
from tdbsim.simulate import DropPlan, Released, Trajectory, check_memory, instants, released

Case = tuple[DropModel, DropPlan]

MOST = 8  # drops in a batch; as many as a vector has numbers
_OF_THE_ROTOR = ("square", "damping", "gyro", "at_end", "weight")


def shared(model: DropModel, plan: DropPlan) -> Hashable:
    """Return what cases have in common that may go side by side, or None where one cannot: the rotor, steps, instants."""
    if plan.method != "splitting" or model.machine.has_heat:
        return None
    arrays = model.arrays
    rotor = b"".join(getattr(arrays, name).tobytes() for name in _OF_THE_ROTOR)
    shapes = model.n, arrays.ball_cosine.shape, arrays.magnet.shape
    return rotor, shapes, longest_step(model, plan), plan.seconds, plan.levitated, plan.sampling


def run_side_by_side(cases: Sequence[Case]) -> list[Trajectory | InputError]:
    """Integrate drops that have `shared` in common, on one thread, without Python's lock.

    Parameters
    ----------
    cases : sequence of (DropModel, DropPlan)
        At most `MOST`.

    Returns
    -------
    list of Trajectory or InputError
        In the order of the cases, as `run` gives them, to rounding; what that would raise where a drop cannot be, which
        does no harm to the others.
    """
    check_memory(*cases[0], times=len(cases))
    compile_apart("lanes", *cases[0])
    count = len(instants(cases[0][1]))
    states = np.empty((len(cases), count, state_layout.size(cases[0][0].n)))
    found: list[Released | InputError] = []
    for model, plan in cases:
        try:
            check_modes(model.n)
            found.append(released(model, plan, states[sum(isinstance(each, Released) for each in found)]))
        except InputError as error:
            found.append(error)
    ready = [each for each in found if isinstance(each, Released)]
    ends = iter(_integrate(ready, states[: len(ready)]) if ready else ())
    return [_finished(each, next(ends)) if isinstance(each, Released) else each for each in found]


def _finished(drop: Released, reached: float) -> Trajectory | InputError:
    try:
        if len(drop.since):
            check_finite(reached, drop.since, drop.state)
    except InputError as error:
        return error
    return drop.trajectory()


def _integrate(ready: list[Released], states: Array) -> list[float]:
    """Fill the drops' states, and return the times reached."""
    from tdbsim.lanes import integrate

    for drop in ready:
        drop.fill_levitated()
    repeated = [*ready, *(ready[-1] for _ in range(MOST - len(ready)))]
    first = ready[0].model.arrays
    arrays = Arrays(
        *(
            getattr(first, name)
            if name in _OF_THE_ROTOR
            else np.array([getattr(d.model.arrays, name) for d in repeated])
            for name in Arrays._fields
        )
    )
    start, peak = np.array([drop.start for drop in repeated]), np.zeros((len(ready), 2))
    step = longest_step(ready[0].model, ready[0].plan)
    reached = integrate(arrays, start, step, ready[0].since, states, ready[0].levitated, peak)
    for drop, greatest in zip(ready, peak, strict=True):
        drop.peak[:] = greatest
    return [float(time) for time in reached]
