"""A support with a different stiffness in one direction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import SUPPORT_XX, SUPPORT_XY, SUPPORT_YY
from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import after_release, bearings

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class SupportAnisotropy(Effect):
    """Stiffness along `direction` is `ratio` times the machine file's; across it, it is unchanged."""

    title: ClassVar = "support anisotropy"
    what: ClassVar = "The support is softer (or stiffer) in one direction."
    place: ClassVar = Place.BEARING_OR_BOTH
    once: ClassVar = True
    signature: ClassVar = "More support motion per newton in one direction than perpendicular to it."
    on_the_machine: ClassVar = (
        "Press the outer ring along x and along y with the same force and read a dial gauge; then inspect joints, "
        "bolts and feet on the softer side."
    )
    rise: ClassVar = 1.3

    ratio: float = parameter(
        "1", 1.0, (0.02, 50.0), 0.4, "ratio of the stiffness along the direction to that perpendicular to it"
    )
    direction: float = parameter("deg", 0.0, (-180.0, 180.0), 0.0, "from +x towards +y", si="rad", harmonic=2)

    def modify(self, draft: Draft) -> None:
        c, s = math.cos(self.direction), math.sin(self.direction)
        for end in self.ends(draft.machine):
            row = draft.arrays.end[end]
            change = (self.ratio - 1) * (row[SUPPORT_XX] + row[SUPPORT_YY]) / 2
            row[SUPPORT_XX] += change * c * c
            row[SUPPORT_XY] += change * c * s
            row[SUPPORT_YY] += change * s * s

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the ratio of mean deflections per newton along x and y, or its inverse where that is greater."""
        found = []
        for at in bearings(after_release(drop, 0.02), where):
            soft = [float(np.std(at[f"support_{axis}"]) / np.std(at[f"force_{axis}"])) for axis in "xy"]
            found.append(max(soft[0] / soft[1], soft[1] / soft[0]))
        return max(found)
