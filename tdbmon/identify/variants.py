"""Variants of a drop: one drop at many values, simulated side by side, and what each leaves of the record.

A simulation in a kernel that takes eight costs half of one alone, and so does what NumPy makes of it.  Each variant takes the
steps that it would take alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.drop_model import DropModel
from tdbsim.ensemble import run_each
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.side_by_side import MOST
from tdbsim.simulate import DropPlan

from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.prediction import Path, Sensors, path_of, residuals, side_by_side

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Variant:
    """A drop at some values: how it moves, and how the probes see it."""

    model: DropModel
    plan: DropPlan
    sensors: Sensors


def paths(measured: MeasuredDrop, variants: Sequence[Variant], horizon: float) -> list[Path | InputError]:
    """Return where variants lead the shaft, or what was raised where one cannot be simulated.

    Parameters
    ----------
    measured : MeasuredDrop
    variants : sequence of Variant
    horizon : float
        s after the release, for which their plans were made.
    """
    return run_each([(each.model, each.plan) for each in variants], lambda moved: path_of(measured, moved, horizon))


def changes(
    measured: MeasuredDrop, machine: Machine, base: Variant, variants: Sequence[Variant], horizon: float
) -> tuple[Array, list[Array | None]]:
    """Return a drop's residuals, and how each variant of it changes them; None where one cannot be simulated.

    The drop is simulated beside its variants: what one does not change, before the first touch for one, is then the same to
    the last bit.  Those that have its model and plan, and are seen otherwise only, are not simulated again.

    Raises
    ------
    InputError
        If the drop itself cannot be simulated.
    """
    moves = [each.model is not base.model or each.plan is not base.plan for each in variants]
    order = sorted(range(len(variants)), key=lambda at: not moves[at])
    moving = [variants[at] for at in order if moves[at]]
    stays, *moved = paths(measured, [base, *moving], horizon)
    if isinstance(stays, InputError):
        raise stays
    unmoved = residuals(stays, measured, machine, base.sensors)
    found = [*moved, *([stays] * (len(variants) - len(moved)))]
    left = left_by(measured, machine, found, [variants[at].sensors for at in order])
    changed = {at: None if each is None else each - unmoved for at, each in zip(order, left, strict=True)}
    return unmoved, [changed[at] for at in range(len(variants))]


def left_by(
    measured: MeasuredDrop, machine: Machine, found: Sequence[Path | InputError], sensors: Sequence[Sensors]
) -> list[Array | None]:
    """Return the residuals of paths as sensors see them; None where there is no path."""
    out: list[Array | None] = [None] * len(found)
    alike: list[list[int]] = []
    for at, path in enumerate(found):
        if isinstance(path, InputError):
            continue
        group = alike[-1] if alike else []
        if group and len(group) < MOST and sensors[group[0]].chain == sensors[at].chain:
            group.append(at)
        else:
            alike.append([at])
    for group in alike:
        seen = [path for at in group if isinstance(path := found[at], Path)]
        together = side_by_side(seen, [sensors[at] for at in group])
        for at, left in zip(group, residuals(together[0], measured, machine, together[1]), strict=True):
            out[at] = left
    return out
