"""Gain error of a displacement channel."""

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
class ProbeGain(Effect):
    """Reading = gain x displacement."""

    title: ClassVar = "probe gain"
    what: ClassVar = "A displacement channel reads too much or too little."
    place: ClassVar = Place.PROBE
    signature: ClassVar = "One channel's motion is always larger or smaller than the others predict."
    on_the_machine: ClassVar = (
        "Calibrate the probe, its cable and its driver together against a micrometer, on the shaft's own material."
    )
    rise: ClassVar = 1.1

    gain: float = parameter("1", 1.0, (0.2, 5.0), 1.2, "reading over displacement")

    def sense(self, chain: SensorChain, machine: Machine, sampling: float) -> SensorChain:
        link = chain.of(self.where)
        return replace(chain, probes={**chain.probes, self.where: replace(link, gain=link.gain * self.gain)})

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the probe's sensitivity to the shaft's motion."""
        return float(np.hypot(*probe_axis(drop, where)))
