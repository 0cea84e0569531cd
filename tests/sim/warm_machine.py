"""The shipped machine with heat in its touchdown bearings."""

from __future__ import annotations

from tdbsim.bearing_heat import BearingHeat
from tdbsim.machine import Machine

STEEL = {
    "elastic_modulus": "210 GPa", "poisson_ratio": 0.3, "density": "7800 kg/m^3", "conductivity": "70 W/(m K)",
    "specific_heat": "510 J/(kg K)", "expansion": "11.8e-6 1/K",
}  # fmt: skip
HEAT = {
    "inner_race_radius": "39 mm", "outer_race_radius": "51 mm", "outer_radius": "55 mm", "housing_radius": "60 mm",
    "width": "20 mm", "housing_width": "30 mm", "shaft_length": "60 mm", "race": STEEL, "ball": STEEL,
    "load_factor": 5e-4, "speed_factor": 1.0, "viscosity": "15 cSt",
}  # fmt: skip


def with_heat(machine: Machine, *ends: str, balls: dict[str, float] | None = None, **changes) -> Machine:
    """Return the machine with heat at some of its ends (at both where none is named), some values of it and its balls changed."""
    heat = BearingHeat.model_validate(HEAT | changes)
    bearings = tuple(
        each.model_copy(update={"heat": heat, "balls": each.balls.model_copy(update=balls or {})})
        if each.name in (ends or machine.ends)
        else each
        for each in machine.touchdown_bearings
    )
    return machine.model_copy(update={"touchdown_bearings": bearings})
