"""Thermal network of a touchdown bearing: nine resistances between shaft, rings, balls, housing and the air.

    ambient -R1- shaft -R2- rub -R3- inner ring -R4- inner contact -R5- balls -R5- outer contact -R7- outer ring -R8-
    housing -R9- ambient, and balls -R6- ambient

One-dimensional, as in N. Neisi, doctoral dissertation (LUT University), section 2.2.3, which names each resistance but gives no
expression.  Here: rings are cylindrical walls, conducting from their middle to their surfaces; the shaft conducts from its
surface to its mean temperature, 1/(8 pi k w); balls conduct over half a diameter through their great circle; R9 is free
convection with h = 23 (T - T_a)^0.25 W/m^2K (Harris); R1 that of a rotating cylinder, Nu = 0.133 Re^(2/3) Pr^(1/3)
(K. M. Becker, Int. J. Heat Mass Transfer 6 (1963)); R6 that of spheres in a stream at the cage's speed, Nu = 2 + 0.6
Re^(1/2) Pr^(1/3) (W. E. Ranz, W. R. Marshall, 1952).  The nodes at rub and ball contacts are massless: they receive heat and
follow at once.  The constriction resistance of the small contacts is neglected.

For thermal growth see `BearingBody.growth`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdbsim.cache import compiled, inlined
from tdbsim.errors import InputError

Array = NDArray[np.float64]

NODES = ("shaft", "rub", "inner_ring", "inner_contact", "balls", "outer_contact", "outer_ring", "housing")
SHAFT, RUB, INNER_RING, INNER_CONTACT, BALLS, OUTER_CONTACT, OUTER_RING, HOUSING = range(8)
_CHAIN = (2, 3, 4, 5, 5, 7, 8)  # resistances between neighbours

GROWTHS = ("shaft", "bore", "inner_race", "outer_race", "ball")

AIR_CONDUCTIVITY = 0.026  # W/(m K), at 20 C
AIR_VISCOSITY = 1.5e-5  # m^2/s
AIR_PRANDTL = 0.71
FREE_CONVECTION = 23.0  # W/(m^2 K^1.25)


@dataclass(frozen=True)
class ThermalMaterial:
    """Conductivity, W/(m K); density, kg/m^3; specific heat, J/(kg K); linear expansion, 1/K; Poisson's ratio."""

    conductivity: float
    density: float
    specific_heat: float
    expansion: float
    poisson_ratio: float


@dataclass(frozen=True)
class BearingBody:
    """The thermal bodies of a bearing; lengths in m.

    Attributes
    ----------
    shaft_radius, bore_radius : float
        Of the rotor and of the inner ring at the rub.
    inner_race_radius, outer_race_radius : float
        Of the inner and of the outer ring's wall at the balls (mean of shoulder and groove).
    outer_radius, housing_radius : float
        Outer radii of outer ring and housing.
    width : float
        Of all rows together.
    housing_width, shaft_length : float
        Of the housing, and of the heated piece of the shaft.
    ball_diameter, pitch_diameter : float
    ball_count : int
        Of all rows.
    race, ball : ThermalMaterial
        Shaft and housing are of the rings' material.
    contact_angle : float
        rad.

    Raises
    ------
    InputError
        If the radii do not increase from the shaft to the housing, or a length is not positive.
    """

    shaft_radius: float
    bore_radius: float
    inner_race_radius: float
    outer_race_radius: float
    outer_radius: float
    housing_radius: float
    width: float
    housing_width: float
    shaft_length: float
    ball_diameter: float
    pitch_diameter: float
    ball_count: int
    race: ThermalMaterial
    ball: ThermalMaterial
    contact_angle: float = 0.0

    def __post_init__(self) -> None:
        radii = (
            "shaft_radius",
            "bore_radius",
            "inner_race_radius",
            "outer_race_radius",
            "outer_radius",
            "housing_radius",
        )
        values = [getattr(self, name) for name in radii]
        for i in range(1, len(radii)):
            if not 0 < values[i - 1] < values[i]:
                raise InputError(
                    f"{radii[i]} {values[i] * 1e3:g} mm must be greater than {radii[i - 1]} {values[i - 1] * 1e3:g} mm"
                )
        for name in ("width", "housing_width", "shaft_length", "ball_diameter", "pitch_diameter", "ball_count"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} {getattr(self, name):g} of the bearing is not positive")

    @property
    def capacity(self) -> Array:
        """Heat capacities of the nodes (8,), J/K; 0 for massless ones."""

        def ring(inside: float, outside: float, width: float) -> float:
            return math.pi * (outside**2 - inside**2) * width * self.race.density * self.race.specific_heat

        balls = self.ball_count * math.pi / 6 * self.ball_diameter**3 * self.ball.density * self.ball.specific_heat
        held = {
            "shaft": ring(0.0, self.shaft_radius, self.shaft_length),
            "inner_ring": ring(self.bore_radius, self.inner_race_radius, self.width),
            "balls": balls,
            "outer_ring": ring(self.outer_race_radius, self.outer_radius, self.width),
            "housing": ring(self.outer_radius, self.housing_radius, self.housing_width),
        }
        return np.array([held.get(node, 0.0) for node in NODES])

    @property
    def conduction(self) -> dict[int, float]:
        """Resistances R2, R3, R4, R5, R7 and R8, K/W."""

        def wall(inside: float, outside: float, width: float) -> float:
            return math.log(outside / inside) / (2 * math.pi * self.race.conductivity * width)

        middle = (self.bore_radius + self.inner_race_radius) / 2
        outer_middle = (self.outer_race_radius + self.outer_radius) / 2
        housing_middle = (self.outer_radius + self.housing_radius) / 2
        return {
            2: 1 / (8 * math.pi * self.race.conductivity * self.width),
            3: wall(self.bore_radius, middle, self.width),
            4: wall(middle, self.inner_race_radius, self.width),
            5: 2 / (math.pi * self.ball.conductivity * self.ball_diameter * self.ball_count),
            7: wall(self.outer_race_radius, outer_middle, self.width),
            8: wall(outer_middle, self.outer_radius, self.width)
            + wall(self.outer_radius, housing_middle, self.housing_width),
        }

    @property
    def to_air(self) -> Array:
        """Coefficients of convection (4,), as used by `air_conductance`."""
        diameter = 2 * self.shaft_radius
        reynolds = math.pi * diameter**2 / AIR_VISCOSITY  # at 1 Hz
        shaft = 0.133 * reynolds ** (2 / 3) * AIR_PRANDTL ** (1 / 3) * AIR_CONDUCTIVITY / diameter
        # the ball centres move at half the speed of the inner race at the contact
        cage = math.pi * (self.pitch_diameter - self.ball_diameter * math.cos(self.contact_angle)) / 2
        stream = 0.6 * math.sqrt(cage * self.ball_diameter / AIR_VISCOSITY) * AIR_PRANDTL ** (1 / 3)
        balls = AIR_CONDUCTIVITY / self.ball_diameter * math.pi * self.ball_diameter**2 * self.ball_count
        housing = FREE_CONVECTION * 2 * math.pi * self.housing_radius * self.housing_width
        return np.array([shaft * math.pi * diameter * self.shaft_length, 2 * balls, stream * balls, housing])

    @property
    def growth(self) -> Array:
        """Matrix from the temperature rises of the nodes to `GROWTHS` of radii (5, 8), m/K, positive outward.

        Rings as in Neisi, section 2.2.5, after G. Sun: (alpha/3)(1 + nu) r/(r + r') (dT (2 r + r') + dT' (2 r' + r)) at the
        radius r of a ring that is warmer by dT there and by dT' at its other side r': the growth in plane strain, exact for a
        temperature linear in the radius.  Neisi uses it for the bore, with the inner contact on the other side, and for the
        outer race, with the housing.  By the same theory the race of the inner ring grows r'/r times as much as its bore, where
        Neisi uses one growth for both.  The shaft, whose growth Neisi neglects, is a solid cylinder of uniform temperature in
        plane strain, alpha (1 + nu) r dT.  Balls grow by alpha r dT.
        """
        strain = self.race.expansion * (1 + self.race.poisson_ratio)

        def side(near: float, far: float) -> tuple[float, float]:
            weight = strain / 3 * near / (near + far)
            return weight * (2 * near + far), weight * (2 * far + near)

        found = np.zeros((len(GROWTHS), len(NODES)))
        found[0, SHAFT] = strain * self.shaft_radius
        found[1, [INNER_RING, INNER_CONTACT]] = side(self.bore_radius, self.inner_race_radius)
        found[2] = found[1] * self.inner_race_radius / self.bore_radius
        found[3, [OUTER_RING, HOUSING]] = side(self.outer_race_radius, self.housing_radius)
        found[4, BALLS] = self.ball.expansion * self.ball_diameter / 2
        return found

    @property
    def network(self) -> Network:
        """The network's constants, as used by `warm`."""
        resistance = self.conduction
        return Network(self.capacity, np.array([1 / resistance[number] for number in _CHAIN]), self.to_air)


class Network(NamedTuple):
    """Heat capacities of the nodes (8,), J/K; conductances between neighbours (7,), W/K; coefficients of convection (4,)."""

    capacity: Array
    chain: Array
    to_air: Array


@inlined
def air_conductance(to_air, shaft_speed, ring_speed, housing_rise):  # type: ignore[no-untyped-def]
    """Return the conductances of shaft, balls and housing to the air, W/K, at speeds, Hz, and a rise of the housing, K."""
    shaft = to_air[0] * abs(shaft_speed) ** (2 / 3)
    return shaft, to_air[1] + to_air[2] * math.sqrt(abs(ring_speed)), to_air[3] * abs(housing_rise) ** 0.25


@compiled
def warm(network, rise, step, rub, inner, outer, shaft_speed, ring_speed):  # type: ignore[no-untyped-def]
    """Advance temperatures by an implicit step, which conserves energy at any step length.

    Parameters
    ----------
    network : Network
    rise : (8,) array
        Temperature rise of each of `NODES` over the air, K; on return at the end of the step (of massless nodes: during it).
    step : float
        s.
    rub, inner, outer : float
        Heat generated during the step at the rub and at the two races, J.
    shaft_speed, ring_speed : float
        Hz.

    Returns
    -------
    float
        Heat given to the air, J.
    """
    capacity, chain = network.capacity, network.chain
    count = len(rise)
    air = np.zeros(count)
    air[SHAFT], air[BALLS], air[HOUSING] = air_conductance(network.to_air, shaft_speed, ring_speed, rise[HOUSING])
    made = np.zeros(count)
    made[RUB], made[INNER_CONTACT], made[OUTER_CONTACT] = rub, inner, outer
    # only neighbours exchange heat: elimination reduces the nodes before each one to one conductance and one source
    seen = np.zeros(count)
    for i in range(count):
        seen[i] = capacity[i] / step + air[i]
        rise[i] = (capacity[i] * rise[i] + made[i]) / step
        if i > 0:
            share = chain[i - 1] / (seen[i - 1] + chain[i - 1])
            seen[i] += share * seen[i - 1]
            rise[i] += share * rise[i - 1]
    lost = 0.0
    for i in range(count - 1, -1, -1):
        if i < count - 1:
            rise[i] = (rise[i] + chain[i] * rise[i + 1]) / (seen[i] + chain[i])
        else:
            rise[i] /= seen[i]
        lost += step * air[i] * rise[i]
    return lost
