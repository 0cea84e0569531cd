"""Unbalance in excess of the balancing sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.effect import Effect, Place, parameter, planes
from tdbsim.signature import before_release, order_phasor

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class Unbalance(Effect):
    """Added to the unbalance of the plane in the machine file."""

    title: ClassVar = "unbalance"
    what: ClassVar = "Unbalance differs from the balancing sheet beyond its tolerance: a lost part, a deposit."
    place: ClassVar = Place.PLANE
    signature: ClassVar = "A synchronous forward orbit, growing with speed, in levitation and after the drop."
    on_the_machine: ClassVar = (
        "Compare 1X of the levitated rotor at one speed with earlier runs; then look for a lost part or a deposit, "
        "and balance."
    )
    rise: ClassVar = 1.2
    adds_to_stated: ClassVar = True

    amount: float = parameter("g mm", 0.0, (0.0, 2000.0), 100.0, "unbalance added to the machine file's", si="kg m")
    phase: float = parameter("deg", 0.0, (-360.0, 360.0), 0.0, "its angle on the shaft from the mark", si="rad")

    def modify(self, draft: Draft) -> None:
        shape = draft.modes.at(planes(draft.machine)[self.where])
        draft.arrays.unbalance[0] += shape * self.amount * math.cos(self.phase)
        draft.arrays.unbalance[1] += shape * self.amount * math.sin(self.phase)

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest levitated 1X amplitude in the probe planes, m."""
        held = before_release(drop)
        angle = held["shaft_angle"].values
        return max(abs(order_phasor(row, angle, 1)) for row in np.atleast_2d(held["shaft_x"].values))
