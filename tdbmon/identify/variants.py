"""Variants of a drop: one drop at several parameter values, simulated side by side, and their residuals.

In a kernel with eight lanes a simulation costs half as much as alone, and so does its evaluation in NumPy.  Each variant takes
the same steps as alone.
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
    """A drop at given parameter values: model, plan and sensors."""

    model: DropModel
    plan: DropPlan
    sensors: Sensors


def paths(measured: MeasuredDrop, variants: Sequence[Variant], horizon: float) -> list[Path | InputError]:
    """Return the paths of variants, or the InputError of those that cannot be simulated.

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
    """Return a drop's residuals, and the change of them in each variant; None where one cannot be simulated.

    The drop is simulated beside its variants, so that samples unaffected by a change (before the first touch, say) are equal to
    the last bit.  Variants with the drop's own model and plan that differ in the sensors only are not simulated again.

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
    """Return the residuals of paths with given sensors; None where there is no path."""
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
