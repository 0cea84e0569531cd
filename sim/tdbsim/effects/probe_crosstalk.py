"""A channel that leaks into its neighbour."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.effect import Effect, Place, parameter
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.signature import probe_axis

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.sensors import SensorChain


@dataclass(frozen=True)
class ProbeCrosstalk(Effect):
    """Second probe's reading + factor x first probe's, in the order of the machine file."""

    title: ClassVar = "Probe crosstalk"
    what: ClassVar = "The first channel of an end leaks into the second."
    place: ClassVar = Place.END
    signature: ClassVar = "The second channel holds some of the first one's motion; the axes seem not square."

    factor: float = parameter("1", 0.0, (-0.5, 0.5), 0.1, "part of the first channel that is added to the second")

    def sense(self, chain: SensorChain, machine: Machine, sampling: float) -> SensorChain:
        if self.is_off:
            return chain
        probes = machine.probes_at(self.where)
        if len(probes) < 2:
            raise InputError(f"probe_crosstalk: end '{self.where}' has {len(probes)} probe(s); crosstalk needs two")
        source, into = probes[0].name, probes[1].name
        return replace(chain, leaks={**chain.leaks, into: (source, self.factor)})

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return how far the second probe's axis leans, rad, and a thousandth."""
        second = [probe for probe in drop["probe"].values if drop[probe].attrs["end"] == where][1]
        x, y = probe_axis(drop, second)
        return float(abs(np.angle((x + 1j * y) * np.exp(-1j * drop[second].attrs["angle_rad"])))) + 1e-3
