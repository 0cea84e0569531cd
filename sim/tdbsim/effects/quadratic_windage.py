"""Windage torque that grows with the square of the speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import DECAY_RATE
from tdbsim.effect import Effect, Place, parameter
from tdbsim.errors import InputError
from tdbsim.machine import Machine
from tdbsim.signature import after_release

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class QuadraticWindage(Effect):
    """Deceleration = speed/tau ((1 - share) + share speed/reference_speed)."""

    title: ClassVar = "quadratic windage"
    what: ClassVar = "The speed does not fall exponentially: drag grows with speed squared."
    place: ClassVar = Place.ROTOR
    signature: ClassVar = "The ratio of deceleration to speed is greater at high speed than at low speed."
    on_the_machine: ClassVar = "Compare pressure and kind of the gas around the rotor with those of earlier coast-downs."
    rise: ClassVar = 1.1
    slots: ClassVar = 2

    share: float = parameter("1", 0.0, (0.0, 1.0), 0.5, "quadratic fraction of the drag at the reference speed")
    reference_speed: float = parameter("Hz", 100.0, (1.0, 5000.0), 100.0, "speed at which the total drag is unchanged")

    @classmethod
    def can_act(cls, machine: Machine) -> bool:
        return machine.rotor.speed_decay_time is not None

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        rate = float(draft.arrays.spin[DECAY_RATE])
        if rate == 0.0:
            raise InputError("quadratic_windage: the machine file states no speed_decay_time; state one under [rotor]")
        return self.share * rate, 2 * math.pi * self.reference_speed

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the work of windage over mean kinetic energy of spin times duration, 1/s."""
        fallen = after_release(drop)
        work = float(fallen["work"].sel(work_kind="windage")[-1])
        energy = float(fallen["energy"].sel(energy_kind="spin").mean())
        return work / energy / float(np.ptp(fallen["time"].values))


def windage(omega, p, i):  # type: ignore[no-untyped-def]
    return -p[i] * omega * (abs(omega) / p[i + 1] - 1.0) if p[i] != 0.0 else 0.0
