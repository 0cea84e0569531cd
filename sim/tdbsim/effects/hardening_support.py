"""A support that stiffens with deflection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import after_release, bearings

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class HardeningSupport(Effect):
    """Spring force = stiffness r + cubic r^3, towards the centre."""

    title: ClassVar = "hardening support"
    what: ClassVar = "The support's stiffness grows with deflection."
    place: ClassVar = Place.BEARING_OR_BOTH
    signature: ClassVar = "Hard impacts move the support less than in proportion to their force."
    on_the_machine: ClassVar = (
        "Press the outer ring with known forces and read a dial gauge: the deflection"
        " grows less than the force; look for a mount that bottoms out."
    )
    rise: ClassVar = 1.1
    slots: ClassVar = 1

    cubic: float = parameter("N/m^3", 0.0, (0.0, 1e20), 1e18, "force per deflection cubed")

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        return (self.cubic,)

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the smallest ratio, over the ends, of rms contact force to rms support motion, N/m."""
        fallen = bearings(after_release(drop), where)
        return min(
            float(
                np.hypot(at["force_x"].std(), at["force_y"].std())
                / np.hypot(at["support_x"].std(), at["support_y"].std())
            )
            for at in fallen
        )


def support(x, y, p, i):  # type: ignore[no-untyped-def]
    hardening = p[i] * (x * x + y * y)
    return -hardening * x, -hardening * y
