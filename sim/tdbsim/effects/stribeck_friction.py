"""Friction that falls with slip speed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import FRICTION
from tdbsim.effect import Effect, Place, choice, parameter
from tdbsim.errors import InputError
from tdbsim.signature import bearings

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class StribeckFriction(Effect):
    """Coefficient = sliding value + static_excess exp(-(slip / stribeck_speed)^n).

    n = 1 (``exponential``, law of Bo and Pavelescu 1982) or n = 2 (``gaussian``); both are in use: B. Armstrong-Helouvry,
    P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083.
    """

    title: ClassVar = "Stribeck friction"
    what: ClassVar = "Friction falls from a static to a sliding value with slip speed."
    place: ClassVar = Place.BEARING_OR_BOTH
    builds_up: ClassVar = True
    signature: ClassVar = "As the ring approaches shaft speed, friction grows: the ring catches up with a jerk."
    on_the_machine: ClassVar = (
        "Inspect journal and ring: lubricant, coating and rub track; compare the material pairing with the design."
    )
    slots: ClassVar = 3

    static_excess: float = parameter("1", 0.0, (-0.5, 1.0), 0.2, "static coefficient minus the sliding one")
    stribeck_speed: float = parameter(
        "m/s", 3.0, (0.05, 50.0), 3.0, "slip speed at which the excess has fallen to 1/e", further=(9.0,)
    )
    law: str = choice(("exponential", "gaussian"), "how the excess falls with slip")

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        sliding = float(draft.arrays.end[end, FRICTION])
        if sliding + self.static_excess < 0:
            raise InputError(
                f"stribeck_friction: static_excess {self.static_excess:g} with the friction of {sliding:g} at"
                f" '{draft.machine.ends[end]}' makes a static coefficient below 0, which would drive the slip; give"
                f" {-sliding:g} or more"
            )
        return self.static_excess, self.stribeck_speed, 2.0 if self.law == "gaussian" else 1.0

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest ratio of friction to normal force."""
        pressed = [at.isel(time=at["normal_force"].values > 50.0) for at in bearings(drop, where)]
        return max(float(np.max(np.abs(at["friction_force"]) / at["normal_force"])) for at in pressed)


def friction(slip, p, i):  # type: ignore[no-untyped-def]
    if p[i] == 0.0:
        return 0.0
    share = abs(slip) / p[i + 1]
    return p[i] * math.exp(-(share**2) if p[i + 2] == 2.0 else -share)
