"""Slopes of a drop's residuals by differences, the drop and what nudges make of it simulated side by side."""

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
    """A drop with one parameter moved a little.

    Attributes
    ----------
    column : int
        Of the parameter among those of the drop.
    step : float
        How far, in coordinates.
    variant : Variant
    """

    column: int
    step: float
    variant: Variant


def slopes(
    measured: MeasuredDrop, machine: Machine, base: Variant, nudged: Sequence[Nudged], columns: int, horizon: float
) -> tuple[Array, Array]:
    """Return a drop's residuals (m,) and their slopes (m, columns), zero in the columns of which nothing is nudged."""
    unmoved, changed = changes(measured, machine, base, [each.variant for each in nudged], horizon)
    jacobian = np.zeros((len(unmoved), columns))
    for each, change in zip(nudged, changed, strict=True):
        if change is not None:
            jacobian[:, each.column] = change / each.step
    return unmoved, jacobian
