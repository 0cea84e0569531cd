"""Temperatures of a touchdown bearing: nine resistances between shaft, rings, balls, housing and the air.

    ambient -R1- shaft -R2- rub -R3- inner ring -R4- inner contact -R5- balls -R5- outer contact -R7- outer ring -R8-
    housing -R9- ambient, and balls -R6- ambient

One-dimensional, as in N. Neisi, doctoral dissertation (LUT University), section 2.2.3, which names what each resistance
is but prints no expression.  Here: rings are walls of cylinders from their middle to their surfaces; the shaft takes heat
from its surface to its mean, 1/(8 pi k w); balls conduct over half a diameter through their great circle; R9 is free
convection with h = 23 (T - T_a)^0.25 W/m^2K (Harris); R1 that of a rotating cylinder, Nu = 0.133 Re^(2/3) Pr^(1/3)
(K. M. Becker, Int. J. Heat Mass Transfer 6 (1963)); R6 that of spheres in the stream of the cage, Nu = 2 + 0.6
Re^(1/2) Pr^(1/3) (W. E. Ranz, W. R. Marshall, 1952).  Where rotor and ring rub and where balls touch races there is no
mass: those nodes take heat and follow at once.  Constriction in the small contacts is left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError

Array = NDArray[np.float64]

NODES = ("shaft", "rub", "inner_ring", "inner_contact", "balls", "outer_contact", "outer_ring", "housing")
SOURCES = {"rub": 1, "inner_race": 3, "outer_race": 5}  # where heat is made, and its node

_CHAIN = (("shaft", "rub", 2), ("rub", "inner_ring", 3), ("inner_ring", "inner_contact", 4),
          ("inner_contact", "balls", 5), ("balls", "outer_contact", 5), ("outer_contact", "outer_ring", 7),
          ("outer_ring", "housing", 8))  # fmt: skip

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
    """The bodies that heat flows through; lengths in m.

    Attributes
    ----------
    shaft_radius, bore_radius : float
        Of the rotor and of the inner ring where they rub.
    inner_race_radius, outer_race_radius : float
        Of the ring walls' inner side and outer side, where the balls run (mean of shoulder and groove).
    outer_radius, housing_radius : float
        Of the outer ring and of the housing, outside.
    width : float
        Of all rows together.
    housing_width, shaft_length : float
        Of the housing, and of the piece of the shaft that takes part.
    ball_diameter, pitch_diameter : float
    ball_count : int
        Of all rows.
    race, ball : ThermalMaterial
        Shaft and housing are of the rings' material.

    Raises
    ------
    InputError
        If the radii do not grow from the shaft to the housing, or a length is not positive.
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
                raise InputError(f"{name} {getattr(self, name):g} of a bearing's body is not positive")

    @property
    def capacity(self) -> Array:
        """Heat capacity of the nodes (8,), J/K; 0 where there is no mass."""

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

    def to_ambient(self, shaft_speed: float, ring_speed: float, housing_rise: float) -> Array:
        """Return the conductances 1/R of the nodes to the air (8,), W/K, at speeds in Hz and the housing's rise in K."""
        diameter = 2 * self.shaft_radius
        reynolds = math.pi * abs(shaft_speed) * diameter**2 / AIR_VISCOSITY
        shaft = 0.133 * reynolds ** (2 / 3) * AIR_PRANDTL ** (1 / 3) * AIR_CONDUCTIVITY / diameter
        cage = math.pi * abs(ring_speed) * (self.pitch_diameter - self.ball_diameter) / 2
        reynolds = cage * self.ball_diameter / AIR_VISCOSITY
        balls = (2 + 0.6 * math.sqrt(reynolds) * AIR_PRANDTL ** (1 / 3)) * AIR_CONDUCTIVITY / self.ball_diameter
        free = {
            "shaft": shaft * math.pi * diameter * self.shaft_length,
            "balls": balls * math.pi * self.ball_diameter**2 * self.ball_count,
            "housing": FREE_CONVECTION
            * abs(housing_rise) ** 0.25
            * 2
            * math.pi
            * self.housing_radius
            * self.housing_width,
        }
        return np.array([free.get(node, 0.0) for node in NODES])


@dataclass(frozen=True)
class Growth:
    """Thermal growth of radii, m: balls, inner ring, outer ring, each (k,)."""

    ball: Array
    inner: Array
    outer: Array


@dataclass(frozen=True)
class Temperatures:
    """Temperatures of a run.

    Attributes
    ----------
    time : (k,) array
        s.
    rise : (8, k) array
        Of each of `NODES` over the ambient, K; at the massless nodes during the step before.
    supplied, lost, stored : (k,) array
        Heat supplied, given to the air and kept since the start, J; the first is the sum of the others.
    """

    time: Array
    rise: Array
    supplied: Array
    lost: Array
    stored: Array

    def of(self, node: str) -> Array:
        """Return the rise (k,) of a node, K."""
        return np.asarray(self.rise[NODES.index(node)])


def temperatures(
    body: BearingBody, time: ArrayLike, power: ArrayLike, shaft_speed: ArrayLike, ring_speed: ArrayLike
) -> Temperatures:
    """Integrate the network from ambient temperature, implicitly: energy is closed in every step, of any length.

    Parameters
    ----------
    body : BearingBody
    time : (k,) array
        Rising, s.
    power : (3, k - 1) array
        Mean heat between the instants at `SOURCES` (rub, inner race, outer race), W.
    shaft_speed, ring_speed : (k,) array
        Hz.

    Raises
    ------
    InputError
        If the shapes do not fit or the time does not rise.
    """
    t = np.asarray(time, dtype=float)
    sources = np.asarray(power, dtype=float)
    shaft, ring = (np.broadcast_to(np.asarray(speed, dtype=float), t.shape) for speed in (shaft_speed, ring_speed))
    if sources.shape != (len(SOURCES), len(t) - 1):
        raise InputError(f"heat of shape {sources.shape} does not fit; give (3, {len(t) - 1}): between the instants")
    if not (np.all(np.diff(t) > 0) and np.all(np.isfinite(sources))):
        raise InputError("the time of a heat history must rise, and its heats be finite")
    chain, capacity = _chain(body), body.capacity
    rise = np.zeros((len(NODES), len(t)))
    lost = np.zeros(len(t))
    heat = np.zeros((len(NODES), len(t) - 1))
    heat[list(SOURCES.values())] = sources
    for i, step in enumerate(np.diff(t)):
        air = body.to_ambient(shaft[i], ring[i], rise[-1, i])
        rise[:, i + 1] = np.linalg.solve(
            np.diag(capacity / step + air) + chain, capacity / step * rise[:, i] + heat[:, i]
        )
        lost[i + 1] = lost[i] + step * float(air @ rise[:, i + 1])
    supplied = np.concatenate([[0.0], np.cumsum(sources.sum(axis=0) * np.diff(t))])
    return Temperatures(t, rise, supplied, lost, capacity @ rise)


def _chain(body: BearingBody) -> Array:
    matrix, resistance = np.zeros((len(NODES), len(NODES))), body.conduction
    for first, second, number in _CHAIN:
        i, j = NODES.index(first), NODES.index(second)
        matrix[[i, j], [i, j]] += 1 / resistance[number]
        matrix[[i, j], [j, i]] -= 1 / resistance[number]
    return matrix


def growth(body: BearingBody, found: Temperatures) -> Growth:
    """Return the growth of balls, inner and outer ring (Neisi, section 2.2.5, after G. Sun).

    eps_b = alpha r_b dT_b; eps_in = (alpha/3)(1 + nu) r_s/(r_i + r_s) (dT_i (2 r_s + r_i) + dT_ci (2 r_i + r_s)), with
    r_s the bore and r_i the race; the outer ring in the same form with the housing.
    """

    def ring(near: float, far: float, near_rise: Array, far_rise: Array) -> Array:
        weight = body.race.expansion / 3 * (1 + body.race.poisson_ratio) * near / (near + far)
        return np.asarray(weight * (near_rise * (2 * near + far) + far_rise * (2 * far + near)))

    return Growth(
        ball=body.ball.expansion * body.ball_diameter / 2 * found.of("balls"),
        inner=ring(body.bore_radius, body.inner_race_radius, found.of("inner_ring"), found.of("inner_contact")),
        outer=ring(body.outer_race_radius, body.housing_radius, found.of("outer_ring"), found.of("housing")),
    )
