"""Waves and lobes of a neighbouring order, tried in the place of those that fail.

Contacts happen where the weight presses, and there waves of one order look much like those of the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from tdbsim.errors import InputError

from tdbmon.diagnosis.attempt import all_from_the_fall
from tdbmon.diagnosis.contender import Contender, with_cause, without_cause
from tdbmon.diagnosis.suspects import Start, Suspect

_DOWN = -math.pi / 2  # rad, where the weight presses


def in_neighbouring_orders(
    fallen: Contender, best: Contender, near: Sequence[Suspect], horizons: Sequence[float]
) -> Contender:
    """Return a contender, or the best of those whose last cause has a wave or a lobe more or less, from the fall on.

    Parameters
    ----------
    fallen : Contender
        The plain model, fitted to the fall.
    best : Contender
        With a cause.
    near : sequence of Suspect
        Its last cause's `neighbours`.
    horizons : sequence of float
        All; fits go along those up to the contender's own.
    """
    if not near:
        return best
    start, others = best.starts()[-1], []
    try:
        bare = without_cause(best, len(best.causes) - 1)
        for each in near:
            apart = _orders_apart(each, best.causes[-1])
            others.append(with_cause(bare, each, _turned_to_the_load(start, each, apart)))
    except InputError:
        return best
    return min([best, *all_from_the_fall(fallen, others, horizons)], key=lambda each: each.misfit)


def neighbours(cause: Suspect, suspects: Sequence[Suspect]) -> list[Suspect]:
    """Return the suspects that differ from a cause by one wave or lobe and are otherwise the same."""
    return [each for each in suspects if abs(_orders_apart(each, cause)) == 1]


def _orders_apart(suspect: Suspect, cause: Suspect) -> float:
    """Return by how many waves or lobes a suspect differs from a cause; 0 where that is not all that differs."""
    if suspect.name != cause.name or suspect.held.keys() != cause.held.keys():
        return 0.0
    orders = {p.name for p in suspect.declared.parameters if p.whole}
    if any(suspect.held[name] != cause.held[name] for name in suspect.held.keys() - orders):
        return 0.0
    return sum(float(suspect.held[name]) - float(cause.held[name]) for name in suspect.held.keys() & orders)


def _turned_to_the_load(start: Start, suspect: Suspect, apart: float) -> Start:
    """Return a start whose waves, so many more than before, stand as before where the weight presses."""
    angles = {
        angle.name: start.shared[angle.name] + apart * _DOWN
        for _, angle in suspect.sizes
        if angle is not None and angle.name in start.shared
    }
    return replace(start, shared={**start.shared, **angles})
