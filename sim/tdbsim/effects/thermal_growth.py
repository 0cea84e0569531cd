"""A gap reduced by frictional heat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import COOLING_RATE
from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import bearings, contact_points

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class ThermalGrowth(Effect):
    """Radial gap = cold gap - growth x heat, with the frictional heat, which decays with `cooling_time`."""

    title: ClassVar = "thermal growth"
    what: ClassVar = "Frictional heat closes the gap while the rotor rubs."
    place: ClassVar = Place.BEARING_OR_BOTH
    builds_up: ClassVar = True
    signature: ClassVar = "The distance at which rotor and ring touch shrinks with the work of friction."
    on_the_machine: ClassVar = (
        "Look for heat colours on ring and journal, and measure the gap cold and after a drop; let it cool before "
        "the next one."
    )
    slots: ClassVar = 1

    growth: float = parameter(
        "nm/J", 0.0, (0.0, 2000.0), 20.0, "radial gap lost per joule of frictional heat", si="m/J"
    )
    cooling_time: float = parameter("s", 20.0, (0.1, 1e5), 20.0, "time in which the heat falls to 1/e", held=True)

    def modify(self, draft: Draft) -> None:
        if self.is_off:
            return
        for end in self.ends(draft.machine):
            draft.arrays.end[end, COOLING_RATE] = 1 / self.cooling_time

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        return (self.growth,)

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the decrease of the distance at contact in the last tenth of the contacts, plus 0.1 um, m."""
        shrunk = []
        for at in bearings(drop, where):
            distance, _, _ = contact_points(drop, str(at["end"].values))
            tenth = max(1, len(distance) // 10)
            shrunk.append(float(np.mean(distance[:tenth]) - np.mean(distance[-tenth:])))
        return max(abs(value) for value in shrunk) + 1e-7


def gap(azimuth, heat, p, i):  # type: ignore[no-untyped-def]
    return -p[i] * heat, 0.0, 0.0
