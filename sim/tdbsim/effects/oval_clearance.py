"""A gap that is not round in the fixed frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tdbsim.effect import Effect, Place, choice, parameter
from tdbsim.signature import contact_points, lobes

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class OvalClearance(Effect):
    """Radial gap = round gap + amplitude cos(2 (azimuth - angle)).

    With the ``radial`` law the normal force acts along the displacement, as usual in rotordynamics, and only the distance at
    contact depends on the direction.  With the ``normal`` law it acts normal to the bore's surface, at an angle of up to
    2 amplitude/gap to the displacement; that force is conservative, the other is not.
    """

    title: ClassVar = "oval clearance"
    what: ClassVar = "The gap is not round in the fixed frame: a two-lobed seat, worn at the bottom."
    place: ClassVar = Place.BEARING
    signature: ClassVar = "The limit of the orbits is an oval; in contact the force is not along the displacement."
    on_the_machine: ClassVar = (
        "Move the rotor with the magnetic bearings once around the clearance: its limit is an oval; then "
        "measure seat and bore in several directions."
    )
    slots: ClassVar = 3

    amplitude: float = parameter("um", 0.0, (-100.0, 100.0), 15.0, "how much wider the gap is along `angle`", si="m")
    angle: float = parameter(
        "deg", 0.0, (-180.0, 180.0), 35.0, "direction of the wide axis from +x towards +y", si="rad", harmonic=2
    )
    law: str = choice(("radial", "normal"), "direction of the normal force")

    def reach(self, draft: Draft, end: int) -> float:
        return abs(self.amplitude)

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        return self.amplitude, self.angle, 1.0 if self.law == "normal" else 0.0

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the 0-pk second harmonic of the distance at contact over the azimuth, plus 0.1 um, m."""
        distance, azimuth, _ = contact_points(drop, where)
        return lobes(distance, azimuth, 2) + 1e-7


def gap(azimuth, heat, p, i):  # type: ignore[no-untyped-def]
    if p[i] == 0.0:
        return 0.0, 0.0, 0.0
    phase = 2.0 * (azimuth - p[i + 1])
    cosine = p[i] * math.cos(phase)
    return cosine, -2.0 * p[i + 2] * p[i] * math.sin(phase), -4.0 * p[i + 2] * cosine
