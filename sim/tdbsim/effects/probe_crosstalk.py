"""Crosstalk between the probes of an end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.effect import Effect, Place, choice, parameter
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.signature import probe_axis

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.sensors import SensorChain


@dataclass(frozen=True)
class ProbeCrosstalk(Effect):
    """Reading of one probe + factor x that of the other; first and second in the order of the machine file."""

    title: ClassVar = "probe crosstalk"
    what: ClassVar = "One channel of an end leaks into the other."
    place: ClassVar = Place.END
    once: ClassVar = True
    signature: ClassVar = "A channel contains part of the other one's motion; the axes do not seem perpendicular."
    on_the_machine: ClassVar = (
        "Disconnect the other probe of the end and move the levitated rotor: the crosstalk disappears with it."
    )

    factor: float = parameter("1", 0.0, (-0.5, 0.5), 0.1, "fraction of one channel that is added to the other")
    into: str = choice(("second", "first"), "the channel that receives it")

    def sense(self, chain: SensorChain, machine: Machine, sampling: float) -> SensorChain:
        if self.is_off:
            return chain
        probes = machine.probes_at(self.where)
        if len(probes) < 2:
            raise InputError(f"probe_crosstalk: end '{self.where}' has {len(probes)} probe(s); crosstalk needs two")
        source, into = (probes[k].name for k in ((0, 1) if self.into == "second" else (1, 0)))
        return replace(chain, leaks={**chain.leaks, into: (source, self.factor)})

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest apparent tilt of a probe's axis, plus 0.001, rad."""
        leaning = [1e-3]
        for probe in drop["probe"].values:
            if drop[probe].attrs["end"] == where:
                x, y = probe_axis(drop, probe)
                leaning.append(1e-3 + float(abs(np.angle((x + 1j * y) * np.exp(-1j * drop[probe].attrs["angle_rad"])))))
        return max(leaning)
