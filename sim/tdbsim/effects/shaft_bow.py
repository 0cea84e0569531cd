"""A bent shaft."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tdbsim.columns import HAS_BOW
from tdbsim.effect import Effect, Place, choice, parameter
from tdbsim.errors import InputError
from tdbsim.signature import before_release, order_phasor

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

    from tdbsim.drop_model import Draft
    from tdbsim.modes import Modes


@dataclass(frozen=True)
class ShaftBow(Effect):
    """Bent with uniform curvature, as by a temperature difference across the shaft, or in the shape of its first bending mode."""

    title: ClassVar = "shaft bow"
    what: ClassVar = "The shaft is bent: a 1X orbit whose size does not fall with speed squared."
    place: ClassVar = Place.ROTOR
    signature: ClassVar = "A synchronous orbit that stays when the speed falls."
    on_the_machine: ClassVar = (
        "Turn the rotor slowly and record the probes: a bow does not change, and all planes lie on one curve;"
        " repeat when the temperature is uniform."
    )
    rise: ClassVar = 1.2

    bow: float = parameter(
        "um", 0.0, (0.0, 300.0), 40.0,
        "greatest distance of the bent axis from the line through the touchdown bearings, between them", si="m",
    )  # fmt: skip
    phase: float = parameter("deg", 0.0, (-360.0, 360.0), 0.0, "direction of the bow from the mark", si="rad")
    shape: str = choice(
        ("even", "bending_mode"), "uniform curvature, or the first bending mode of the free shaft"
    )

    def modify(self, draft: Draft) -> None:
        modes = draft.modes
        first, second = sorted(bearing.position for bearing in draft.machine.touchdown_bearings)
        bent_to = _even_curve if self.shape == "even" else _first_bending_mode
        bent = modes.vectors.T @ (modes.model.plane_mass @ (self.bow * bent_to(modes, first, second)))
        if not self.is_off:
            draft.arrays.spin[HAS_BOW] = 1.0
        draft.arrays.bow[0] += bent * math.cos(self.phase)
        draft.arrays.bow[1] += bent * math.sin(self.phase)

    @classmethod
    def measure(cls, drop: xr.Dataset, where: str) -> float:
        """Return the greatest levitated 1X amplitude in the probe planes, m."""
        held = before_release(drop)
        angle = held["shaft_angle"].values
        return max(abs(order_phasor(row, angle, 1)) for row in np.atleast_2d(held["shaft_x"].values))


def _even_curve(modes: Modes, first: float, second: float) -> NDArray[np.float64]:
    """Return a parabola in the coordinates of the rotor model, 0 at two positions and 1 midway between them."""
    share = (modes.model.nodes - first) / (second - first)
    return np.column_stack([4 * share * (1 - share), 4 * (1 - 2 * share) / (second - first)]).ravel()


def _first_bending_mode(modes: Modes, first: float, second: float) -> NDArray[np.float64]:
    """Return the mode scaled so that between two positions its greatest distance from the line through them is 1."""
    if not modes.bending:
        raise InputError("shaft_bow: shape bending_mode needs a model with a bending mode; this one keeps none")
    mode = modes.vectors[:, modes.names.index("bending 1")]
    between = np.linspace(first, second, 201)
    ends = modes.model.plane_rows([first, second]) @ mode
    bow = modes.model.plane_rows(between) @ mode - np.interp(between, [first, second], ends)
    return mode / bow[np.argmax(np.abs(bow))]
