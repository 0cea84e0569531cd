"""A wavy raceway."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.effect import Effect, Place, choice, parameter
from tdbsim.signature import after_release

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class RaceWaviness(Effect):
    """Radial interference of a ball at azimuth beta + amplitude cos(order (beta - ring angle) - phase) / cos(contact angle).

    On an outer race without the ring angle.

    State it several times for waves of several orders, in one race or in both.
    """

    title: ClassVar = "race waviness"
    what: ClassVar = (
        "A raceway is wavy: the ball loads are modulated at multiples of ring or cage speed."
        " For several orders, in one race or in both, give the effect several times."
    )
    place: ClassVar = Place.BEARING
    signature: ClassVar = "Ball loads follow the waves of the race; lines at multiples of ring or cage speed."
    on_the_machine: ClassVar = (
        "Turn the inner ring slowly by hand under a dial gauge: waves of a race repeat with the passing balls; "
        "then look at the races for dents."
    )
    slots: ClassVar = 4
    most: ClassVar = 16
    fixed_by: ClassVar = {"race": "outer"}

    amplitude: float = parameter("um", 0.0, (0.0, 20.0), 5.0, "0-pk height of the waves", si="m")
    order: float = parameter("1", 2.0, (1.0, 30.0), 2.0, "number of waves around the race", whole=True)
    phase: float = parameter(
        "deg", 0.0, (-360.0, 360.0), 0.0, "of the waves in the race at the release", si="rad", per_drop=True
    )
    race: str = choice(("inner", "outer"), "the race that is wavy; the inner one turns with the ring")

    def reach(self, draft: Draft, end: int) -> float:
        return self.amplitude / math.cos(draft.machine.touchdown_bearings[end].balls.contact_angle)

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        return self.reach(draft, end), self.order, self.phase, 1.0 if self.race == "inner" else 0.0

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the relative second harmonic of the ball loads over the angle on the inner race: 0 for none, 1 for full."""
        at = after_release(drop).sel(end=where)
        load, count = at["ball_load"].values, at.sizes["ball"]
        azimuth = at["cage_angle"].values + 2 * np.pi * np.arange(count)[:, None] / count
        return float(abs(np.sum(load * np.exp(-2j * (azimuth - at["ring_angle"].values)))) / np.sum(load))


def ball(azimuth, ring_angle, p, i):  # type: ignore[no-untyped-def]
    if p[i] == 0.0:
        return 0.0
    return p[i] * math.cos(p[i + 1] * (azimuth - p[i + 3] * ring_angle) - p[i + 2])
