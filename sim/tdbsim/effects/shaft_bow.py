"""A bent shaft."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import HAS_BOW
from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import before_release, order_phasor

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class ShaftBow(Effect):
    """Curved evenly along its length, as by a difference of temperature across it."""

    title: ClassVar = "Shaft bow"
    what: ClassVar = "The shaft is bent: a 1X orbit whose size does not fall with speed squared."
    place: ClassVar = Place.ROTOR
    signature: ClassVar = "A synchronous orbit that stays when the speed falls."
    rise: ClassVar = 1.2

    bow: float = parameter(
        "um", 0.0, (0.0, 300.0), 40.0,
        "greatest distance of the bent axis from the line through the touchdown bearings, between them", si="m",
    )  # fmt: skip
    phase: float = parameter("deg", 0.0, (-360.0, 360.0), 0.0, "direction of the bow from the mark", si="rad")

    def modify(self, draft: Draft) -> None:
        first, second = sorted(bearing.position for bearing in draft.machine.touchdown_bearings)
        model = draft.modes.model
        share = (model.nodes - first) / (second - first)
        deflection = self.bow * 4 * share * (1 - share)
        slope = self.bow * 4 * (1 - 2 * share) / (second - first)
        bent = draft.modes.vectors.T @ (model.plane_mass @ np.column_stack([deflection, slope]).ravel())
        if not self.is_off:
            draft.arrays.spin[HAS_BOW] = 1.0
        draft.arrays.bow[0] += bent * math.cos(self.phase)
        draft.arrays.bow[1] += bent * math.sin(self.phase)

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest levitated 1X amplitude of the probe planes, m."""
        held = before_release(drop)
        angle = held["shaft_angle"].values
        return max(abs(order_phasor(row, angle, 1)) for row in np.atleast_2d(held["shaft_x"].values))
