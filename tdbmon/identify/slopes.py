"""Jacobian of a drop's residuals by differences, the drop and its nudged variants simulated side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import Machine

from tdbmon.identify.drop import MeasuredDrop
from tdbmon.identify.variants import Variant, changes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Nudged:
    """A drop with one parameter moved by a difference step.

    Attributes
    ----------
    column : int
        Index of the parameter among those of the drop.
    step : float
        In coordinates.
    variant : Variant
    """

    column: int
    step: float
    variant: Variant


def slopes(
    measured: MeasuredDrop, machine: Machine, base: Variant, nudged: Sequence[Nudged], columns: int, horizon: float
) -> tuple[Array, Array]:
    """Return a drop's residuals (m,) and Jacobian (m, columns), zero in the columns without a nudge."""
    unmoved, changed = changes(measured, machine, base, [each.variant for each in nudged], horizon)
    jacobian = np.zeros((len(unmoved), columns))
    for each, change in zip(nudged, changed, strict=True):
        if change is not None:
            jacobian[:, each.column] = change / each.step
    return unmoved, jacobian
