"""A ball of another size."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tdbsim.columns import BALL_COUNT
from tdbsim.effect import Effect, Place, parameter
from tdbsim.errors import InputError
from tdbsim.signature import after_release

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class OffSizedBall(Effect):
    """State it several times for several balls."""

    title: ClassVar = "off-sized ball"
    what: ClassVar = "One or more balls are too large or too small: lines at cage speed."
    place: ClassVar = Place.BEARING
    rise: ClassVar = 1.1
    signature: ClassVar = "One ball carries more or less than the others; lines at cage speed."
    on_the_machine: ClassVar = (
        "Turn the inner ring slowly by hand under a dial gauge: an odd ball repeats with the cage,"
        " about 0.4 turns per turn of the ring; then measure the balls."
    )

    deviation: float = parameter("um", 0.0, (-50.0, 50.0), 10.0, "diameter minus that of the others", si="m")
    ball: float = parameter(
        "1", 1.0, (1.0, 60.0), 1.0, "number of the ball, 1 at the cage's angle", whole=True, per_drop=True
    )

    def modify(self, draft: Draft) -> None:
        for end in self.ends(draft.machine):
            count = int(draft.arrays.end[end, BALL_COUNT])
            if self.ball > count:
                raise InputError(f"off_sized_ball: ball {self.ball:g} given; '{self.where}' has {count} balls")
            # the oversize acts along the contact angle, the shaft's displacement radially
            angle = draft.machine.touchdown_bearings[end].balls.contact_angle
            draft.arrays.ball_oversize[end, int(self.ball) - 1] += self.deviation / math.cos(angle)

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest mean load of a ball over the mean load of all."""
        load = after_release(drop)["ball_load"].sel(end=where).mean("time")
        return float(load.max() / load.mean())
