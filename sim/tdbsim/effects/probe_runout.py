"""Runout of the surface under the probes of an end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.effect import Effect, Place, parameter
from tdbsim.machine import Machine
from tdbsim.signature import before_release, order_phasor

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.sensors import SensorChain


@dataclass(frozen=True)
class ProbeRunout(Effect):
    """Radial deviation of the surface = first cos(beta - first_phase) + second cos(2 (beta - second_phase)) on the shaft."""

    title: ClassVar = "probe runout"
    what: ClassVar = "The probe sees the shaft surface's runout, at every speed, in levitation too."
    place: ClassVar = Place.END
    signature: ClassVar = "1X and 2X in the channels of an end that stay the same at every speed."
    on_the_machine: ClassVar = (
        "Turn the rotor slowly and record the probes: runout does not change; then inspect the probe track."
    )

    first: float = parameter("um", 0.0, (0.0, 100.0), 5.0, "0-pk amplitude at 1X", si="m")
    first_phase: float = parameter(
        "deg", 0.0, (-360.0, 360.0), 0.0, "angle of its crest on the shaft from the mark", si="rad", per_drop=True
    )
    second: float = parameter("um", 0.0, (0.0, 100.0), 3.0, "0-pk amplitude at 2X", si="m")
    second_phase: float = parameter(
        "deg", 0.0, (-360.0, 360.0), 0.0, "angle of a crest on the shaft from the mark", si="rad", harmonic=2, per_drop=True
    )

    @property
    def is_off(self) -> bool:
        return self.first == 0.0 and self.second == 0.0

    def sense(self, chain: SensorChain, machine: Machine, sampling: float) -> SensorChain:
        from tdbsim.sensors import Runout

        if self.is_off:
            return chain
        surface = (Runout(1, self.first, self.first_phase), Runout(2, self.second, self.second_phase))
        probes = dict(chain.probes)
        for probe in machine.probes_at(self.where):
            link = chain.of(probe.name)
            probes[probe.name] = replace(link, runout=(*link.runout, *surface))
        return replace(chain, probes=probes)

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest difference of levitated 1X and 2X between the end's readings and the shaft, plus 0.1 um, m."""
        held = before_release(drop)
        angle = held["shaft_angle"].values
        found = [1e-7]
        for probe in drop["probe"].values:
            axis = drop[probe].attrs["angle_rad"]
            if drop[probe].attrs["end"] == where:
                at = held.sel(probe=probe)
                seen = held[probe].values - at["shaft_x"].values * np.cos(axis) - at["shaft_y"].values * np.sin(axis)
                found.append(abs(order_phasor(seen, angle, 1)) + abs(order_phasor(seen, angle, 2)) + 1e-7)
        return max(found)
