"""A gap that is not round in the fixed frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import contact_points, lobes

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class OvalClearance(Effect):
    """Radial gap = round gap + amplitude cos(2 (azimuth - angle))."""

    title: ClassVar = "Oval clearance"
    what: ClassVar = "The gap is not round in the fixed frame: a two-lobed seat, worn at the bottom."
    place: ClassVar = Place.BEARING
    signature: ClassVar = "The orbits' limit is an oval; in contact the force leans off the displacement."
    slots: ClassVar = 2

    amplitude: float = parameter("um", 0.0, (-100.0, 100.0), 15.0, "how much wider the gap is along `angle`", si="m")
    angle: float = parameter("deg", 0.0, (-180.0, 180.0), 35.0, "direction of the wide axis from +x towards +y", si="rad")

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        return self.amplitude, self.angle

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the two-lobed part of the distance at which rotor and ring touch, m, and a tenth of a micrometre."""
        distance, azimuth, _ = contact_points(drop, where)
        return lobes(distance, azimuth, 2) + 1e-7


def gap(azimuth, heat, p, i):  # type: ignore[no-untyped-def]
    if p[i] == 0.0:
        return 0.0, 0.0, 0.0
    phase = 2.0 * (azimuth - p[i + 1])
    cosine = p[i] * math.cos(phase)
    return cosine, -2.0 * p[i] * math.sin(phase), -4.0 * cosine
