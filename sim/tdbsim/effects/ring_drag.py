"""Additional drag torque on an inner ring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tdbsim.columns import RING_DRAG
from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import after_release

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class RingDrag(Effect):
    """Added to the drag in the machine file."""

    title: ClassVar = "ring drag"
    what: ClassVar = (
        "The inner ring is hard to turn (dried grease, damaged bearing): it takes long to reach shaft speed."
    )
    place: ClassVar = Place.BEARING
    builds_up: ClassVar = True
    signature: ClassVar = "The ring lags behind the shaft; slip and rubbing last longer."
    on_the_machine: ClassVar = (
        "Turn the inner ring by hand, and compare the torque that keeps it turning with that of a new bearing; look for "
        "dried grease and dents."
    )
    slows: ClassVar = True
    rise: ClassVar = 1.05

    torque: float = parameter("N m", 0.0, (0.0, 50.0), 0.5, "added drag torque")

    def modify(self, draft: Draft) -> None:
        for end in self.ends(draft.machine):
            draft.arrays.end[end, RING_DRAG] += self.torque

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the mean ratio of slip to shaft speed after the release."""
        fallen = after_release(drop)
        return float(1 - abs(fallen["ring_speed"].sel(end=where)).mean() / abs(fallen["rotor_speed"]).mean())
