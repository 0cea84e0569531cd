"""A probe whose angle differs from the drawing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.effect import Effect, Place, parameter
from tdbsim.machine import Machine
from tdbsim.signature import probe_axis

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.sensors import SensorChain


@dataclass(frozen=True)
class ProbeAngle(Effect):
    """True angle = angle in the machine file + error."""

    title: ClassVar = "probe angle"
    what: ClassVar = "A probe does not stand at the angle on the drawing."
    place: ClassVar = Place.PROBE
    signature: ClassVar = "The channel contains part of the motion perpendicular to its axis."
    on_the_machine: ClassVar = (
        "Move the levitated rotor along x and y of that plane: the probe sees motion perpendicular to its axis; then compare its "
        "mounting with the drawing."
    )

    error: float = parameter(
        "deg", 0.0, (-45.0, 45.0), 8.0, "true angle minus that of the drawing, from +x towards +y", si="rad"
    )

    def sense(self, chain: SensorChain, machine: Machine, sampling: float) -> SensorChain:
        link = chain.of(self.where)
        turned = replace(link, angle_error=link.angle_error + self.error)
        return replace(chain, probes={**chain.probes, self.where: turned})

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the angle between the probe's axis and that in the drawing, plus 0.001, rad."""
        x, y = probe_axis(drop, where)
        return float(abs(np.angle((x + 1j * y) * np.exp(-1j * drop[where].attrs["angle_rad"])))) + 1e-3
