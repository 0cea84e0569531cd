"""Cross-coupled stiffness of a seal or wheel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import HAS_CIRCULATORY
from tdbsim.effect import Effect, Place, parameter, planes
from tdbsim.signature import after_release

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class CrossCoupledStiffness(Effect):
    """A force perpendicular to the displacement: F_x = -k y, F_y = k x for counter-clockwise rotation."""

    title: ClassVar = "cross-coupled stiffness"
    what: ClassVar = "A seal or wheel feeds energy into forward whirl."
    place: ClassVar = Place.PLANE
    signature: ClassVar = "Work is done on the lateral motion; a force acts perpendicular to the rotor's displacement."
    on_the_machine: ClassVar = (
        "Compare the seals' clearances and swirl brakes with the drawing, and the damping of forward with that of "
        "backward whirl while levitated."
    )

    stiffness: float = parameter("N/m", 0.0, (0.0, 5e6), 2e5, "positive drives forward whirl")

    def modify(self, draft: Draft) -> None:
        shape = draft.modes.at(planes(draft.machine)[self.where])
        draft.arrays.circulatory[:] += draft.machine.sense * self.stiffness * np.outer(shape, shape)
        if not self.is_off:
            draft.arrays.spin[HAS_CIRCULATORY] = 1.0

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the mean sideways force of the bearings, which balances the cross-coupling, plus 5 N, N."""
        fallen = after_release(drop, 0.02)
        return abs(float(fallen["force_x"].sum("end").mean())) + 5.0
