"""Residual magnetic force after switch-off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tdbsim.effect import Effect, Place, choice, parameter
from tdbsim.signature import after_release

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class ResidualMagneticForce(Effect):
    """The force of each magnetic bearing at the release decays as exp(-t / decay_time), or as 1 - t / decay_time to zero.

    The former where the coil current decays through a resistance, the latter where a constant voltage drives it down.
    """

    title: ClassVar = "residual magnetic force"
    what: ClassVar = "The magnetic force does not vanish at switch-off but decays, so the fall starts late and gently."
    place: ClassVar = Place.ROTOR
    signature: ClassVar = "At the release the rotor accelerates by less than gravity; the first contact comes late."
    on_the_machine: ClassVar = (
        "Record the coils' currents at the release: they should decay as fast as the amplifiers' shut-down specifies."
    )
    slots: ClassVar = 2

    decay_time: float = parameter(
        "ms", 0.0, (0.0, 50.0), 2.0, "time in which the force falls to 1/e, or with the linear law to zero", si="s"
    )
    law: str = choice(("exponential", "linear"), "law of the decay")

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        return self.decay_time, 1.0 if self.law == "linear" else 0.0

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the delay of the first contact against a free fall through the same height, plus 0.1 ms, s."""
        fallen = after_release(drop)
        touch = int((fallen["depth"].max("end").values > 0).argmax())
        height = float((fallen["rotor_y"].isel(time=0) - fallen["rotor_y"].isel(time=touch)).mean())
        flight = float(fallen["time"][touch]) - float(drop.attrs["release_time_s"])
        return abs(flight - math.sqrt(2 * height / drop.attrs["gravity_m_per_s2"])) + 1e-4


def holding(seconds, p, i):  # type: ignore[no-untyped-def]
    if p[i] == 0.0:
        return 0.0
    return max(1.0 - seconds / p[i], 0.0) if p[i + 1] == 1.0 else math.exp(-seconds / p[i])
