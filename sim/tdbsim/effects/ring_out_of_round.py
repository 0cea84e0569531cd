"""A lobed bore of the inner ring."""

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
class RingOutOfRound(Effect):
    """Radial gap = round gap + amplitude cos(order (azimuth - ring angle) - phase); `law` as in `oval_clearance`."""

    title: ClassVar = "ring out of round"
    what: ClassVar = "The inner ring's bore is lobed and turns with the ring."
    place: ClassVar = Place.BEARING
    signature: ClassVar = "Lines at `order` times the inner ring's speed, which follow it as it runs up."
    on_the_machine: ClassVar = (
        "Turn the inner ring slowly by hand under a dial gauge in its bore: lobes repeat with the ring."
    )
    slots: ClassVar = 4

    amplitude: float = parameter("um", 0.0, (0.0, 50.0), 10.0, "0-pk height of the lobes", si="m")
    order: float = parameter("1", 2.0, (1.0, 12.0), 2.0, "number of lobes", whole=True)
    phase: float = parameter(
        "deg", 0.0, (-360.0, 360.0), 0.0, "of the lobes in the ring at the release", si="rad", per_drop=True
    )
    law: str = choice(("radial", "normal"), "direction of the normal force")

    def reach(self, draft: Draft, end: int) -> float:
        return abs(self.amplitude)

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        return self.amplitude, self.order, self.phase, 1.0 if self.law == "normal" else 0.0

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the 0-pk second harmonic of the distance at contact over the angle on the ring, plus 0.1 um, m."""
        distance, azimuth, ring = contact_points(drop, where)
        return lobes(distance, azimuth - ring, 2) + 1e-7


def bore(azimuth, p, i):  # type: ignore[no-untyped-def]
    if p[i] == 0.0:
        return 0.0, 0.0, 0.0
    phase = p[i + 1] * azimuth - p[i + 2]
    cosine = p[i] * math.cos(phase)
    return cosine, -p[i + 3] * p[i + 1] * p[i] * math.sin(phase), -p[i + 3] * p[i + 1] ** 2 * cosine
