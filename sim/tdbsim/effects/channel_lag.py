"""Time delay of a channel."""

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
class ChannelLag(Effect):
    """Reading(t) = true reading(t - delay)."""

    title: ClassVar = "channel lag"
    what: ClassVar = "A channel lags behind the others."
    place: ClassVar = Place.PROBE
    signature: ClassVar = "The channel's phase lag grows in proportion to frequency; its contacts appear late."
    on_the_machine: ClassVar = "Feed one signal into all channels at once, and compare filters, cables and sampling."

    delay: float = parameter("us", 0.0, (0.0, 20000.0), 500.0, "time by which it lags", si="s")

    def sense(self, chain: SensorChain, machine: Machine, sampling: float) -> SensorChain:
        link = chain.of(self.where)
        late = replace(link, lag=link.lag + self.delay * sampling)
        return replace(chain, probes={**chain.probes, self.where: late})

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the phase lag of the channel behind the shaft at levitated 1X, plus 0.001, rad."""
        held = before_release(drop)
        held = held.isel(time=slice(held.sizes["time"] // 2, None))
        axis, at = drop[where].attrs["angle_rad"], held.sel(probe=where)
        angle = held["shaft_angle"].values
        true = at["shaft_x"].values * np.cos(axis) + at["shaft_y"].values * np.sin(axis)
        return float(abs(np.angle(order_phasor(held[where].values, angle, 1) / order_phasor(true, angle, 1)))) + 1e-3
