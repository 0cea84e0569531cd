"""Drops of one rotor side by side, up to eight in one kernel (`tdbsim.lanes`)."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace

import numpy as np

from tdbsim import state_layout
from tdbsim.drop_model import DropModel
from tdbsim.errors import InputError
from tdbsim.first_use import compile_apart
from tdbsim.integration import check_finite, check_modes, check_open, longest_step
from tdbsim.levitation import fill_levitated
from tdbsim.release import OF_THE_ROTOR, begin, chosen, side_by_side
from tdbsim.simulate import DropPlan, Trajectory, before_release, check_memory, instants

Case = tuple[DropModel, DropPlan]

MOST = 8  # drops in a batch, the number of lanes of a vector


def shared(model: DropModel, plan: DropPlan) -> Hashable:
    """Return the key of cases that may run side by side (rotor, step, instants); None where a case cannot."""
    if plan.method != "splitting" or model.machine.has_heat:
        return None
    try:
        step = longest_step(model, plan)
    except InputError:  # raised again when it runs alone
        return None
    arrays = model.arrays
    rotor = b"".join(getattr(arrays, name).tobytes() for name in OF_THE_ROTOR)
    shapes = model.n, arrays.ball_cosine.shape, arrays.magnet.shape
    return rotor, shapes, step, plan.seconds, plan.levitated, plan.sampling


def run_side_by_side(cases: Sequence[Case]) -> list[Trajectory | InputError]:
    """Integrate drops with equal `shared` key on one thread, without the global interpreter lock.

    Parameters
    ----------
    cases : sequence of (DropModel, DropPlan)
        At most `MOST`.

    Returns
    -------
    list of Trajectory or InputError
        In the order of the cases, equal to those of `run` to rounding; for an impossible drop the error that `run` would raise,
        without effect on the others.
    """
    from tdbsim.lanes import integrate

    models, plans = [model for model, _ in cases], [plan for _, plan in cases]
    plan, n = plans[0], models[0].n
    check_memory(models[0], plan, times=len(cases))
    compile_apart("lanes", models[0], plan)
    try:
        check_modes(n)
    except InputError as error:
        return [error] * len(cases)
    arrays = side_by_side(models)
    start, whirl, faults = begin(arrays, models, plans)
    ready = [k for k, fault in enumerate(faults) if fault is None]
    if not ready:
        return [each for each in faults if each is not None]
    time = instants(plan)
    levitated = before_release(plan, time)
    since, peak = time - plan.levitated, np.zeros((len(ready), 2))
    states = np.empty((len(ready), len(time), state_layout.size(n)))
    fill_levitated(whirl[ready], since[:levitated], start[ready], states)
    lanes = [*ready, *(ready[-1] for _ in range(MOST - len(ready)))]
    whole = arrays if lanes == list(range(MOST)) else chosen(arrays, lanes)
    step = longest_step(models[0], plan)
    reached = integrate(whole, start[lanes], step, since[levitated:], states, levitated, peak)
    found: list[Trajectory | InputError | None] = list(faults)
    for k, state, greatest, end in zip(ready, states, peak, reached[: len(ready)].tolist(), strict=True):
        try:
            if levitated < len(time):
                check_open(models[k], end, since[levitated:], state[levitated:])
                check_finite(end, since[levitated:], state)
        except InputError as error:
            found[k] = error
            continue
        model = replace(models[k], arrays=models[k].arrays._replace(end=arrays.end[k], magnet=arrays.magnet[k]))
        found[k] = Trajectory(model, plans[k], time, state, greatest, whirl[k])
    return [each for each in found if each is not None]
