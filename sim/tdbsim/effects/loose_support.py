"""Play of the bearing in its housing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tdbsim.columns import SUPPORT_XX, SUPPORT_XY, SUPPORT_YY
from tdbsim.effect import Effect, Place, parameter
from tdbsim.signature import after_release, bearings

if TYPE_CHECKING:
    import xarray as xr

    from tdbsim.drop_model import Draft


@dataclass(frozen=True)
class LooseSupport(Effect):
    """Within the radial play the spring has `stiffness_ratio` times its stiffness, beyond it the full stiffness.

    The remaining part of the stiffness acts through a seat, compressed by the excess of the radial displacement r over the play:
    it stores the energy (1 - play/r)^2 r K r / 2, with its stiffness matrix K, which may be anisotropic.  So the force is
    conservative and restoring everywhere.
    """

    title: ClassVar = "loose support"
    what: ClassVar = "The bearing has play in its housing: soft within the play, stiff beyond it."
    place: ClassVar = Place.BEARING
    signature: ClassVar = "The support moves by about the play under a small force; contacts are deeper."
    on_the_machine: ClassVar = (
        "Push and lift the outer ring at standstill and read a dial gauge: it moves by the play; then check seat, bolts "
        "and resilient mount."
    )
    rise: ClassVar = 1.2
    slots: ClassVar = 4

    play: float = parameter(
        "um", 0.0, (0.0, 200.0), 20.0, "radial distance from the centre to where the support is stiff", si="m"
    )
    stiffness_ratio: float = parameter("1", 0.1, (0.001, 1.0), 0.1, "ratio of the stiffness within the play to that beyond it")

    def coefficients(self, draft: Draft, end: int) -> tuple[float, ...]:
        row, missing = draft.arrays.end[end], 1 - self.stiffness_ratio
        return self.play, missing * row[SUPPORT_XX], missing * row[SUPPORT_XY], missing * row[SUPPORT_YY]

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest support motion, m."""
        at = bearings(after_release(drop), where)[0]
        return float(((at["support_x"] ** 2 + at["support_y"] ** 2) ** 0.5).max())


def support(x, y, p, i):  # type: ignore[no-untyped-def]
    if p[i] == 0.0:
        return 0.0, 0.0
    fx, fy = p[i + 1] * x + p[i + 2] * y, p[i + 2] * x + p[i + 3] * y
    squared = x * x + y * y
    if squared <= p[i] * p[i]:
        return fx, fy
    loose = p[i] / math.sqrt(squared)
    pressed = 1.0 - loose
    inwards = pressed * loose * (fx * x + fy * y) / squared
    return (1.0 - pressed * pressed) * fx - inwards * x, (1.0 - pressed * pressed) * fy - inwards * y
