"""A flexible foundation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import FOUNDATION_DAMPING, FOUNDATION_MOBILITY, FOUNDATION_STIFFNESS
from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import after_release, bearings

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class FoundationMode(Effect):
    """The support is mounted on a mass on a spring and damper; with infinite stiffness the foundation is rigid."""

    title: ClassVar = "foundation mode"
    what: ClassVar = "The support stands on a flexible foundation: one more mass and spring under it."
    place: ClassVar = Place.BEARING_OR_BOTH
    once: ClassVar = True
    signature: ClassVar = "A line at the foundation's frequency; the support moves more per newton."
    on_the_machine: ClassVar = (
        "Tap the pedestal near an accelerometer: it rings at that frequency; then check grout and bolts."
    )

    stiffness: float = parameter("N/m", math.inf, (1e5, 1e12), 3e7, "of the foundation, in each direction")
    mass: float = parameter("kg", 80.0, (1.0, 1e5), 80.0, "that moves with the foundation")
    damping: float = parameter("N s/m", 2000.0, (0.0, 1e6), 2000.0, "of the foundation, in each direction")

    def modify(self, draft: Draft) -> None:
        if self.is_off:
            return
        for end in self.ends(draft.machine):
            row = draft.arrays.end[end]
            row[FOUNDATION_MOBILITY], row[FOUNDATION_STIFFNESS] = 1 / self.mass, self.stiffness
            row[FOUNDATION_DAMPING] = self.damping

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the smallest ratio, over the ends, of rms support motion to rms contact force, m/N."""
        return min(
            float(
                np.hypot(at["support_x"].std(), at["support_y"].std())
                / np.hypot(at["force_x"].std(), at["force_y"].std())
            )
            for at in bearings(after_release(drop), where)
        )
