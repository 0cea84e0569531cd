"""Exact elliptical Hertz contact of balls and raceways.

The elliptic integrals are computed in Carlson's form, which loses no digits where the ellipse is nearly a circle:
with m = 1 - 1/kappa^2, m1 = 1/kappa^2 and B = E(m) - m1 K(m) over m, D = K(m) - E(m) over m, both positive,
K = B + D, E = B + m1 D, and the ratio of the relative radii of curvature is B/(m1 D).

References
----------
B. J. Hamrock, S. R. Schmid, B. O. Jacobson, Fundamentals of Fluid Film Lubrication, 2nd ed. (2004), ch. 17.
T. A. Harris, M. N. Kotzalas, Essential Concepts of Bearing Technology, 5th ed. (2007), ch. 2 and 6.
K. L. Johnson, Contact Mechanics (1985), ch. 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdbsim.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Material:
    """An elastic material: Young's modulus, Pa, and Poisson's ratio."""

    elastic_modulus: float
    poisson_ratio: float


BEARING_STEEL = Material(210e9, 0.30)
SILICON_NITRIDE = Material(310e9, 0.26)  # balls of hybrid bearings


def effective_modulus(first: Material, second: Material) -> float:
    """Return the effective modulus E' = 2/((1 - nu1^2)/E1 + (1 - nu2^2)/E2), Pa."""
    compliance = sum((1 - body.poisson_ratio**2) / body.elastic_modulus for body in (first, second))
    return 2 / compliance


def ellipticity(radius_ratio: ArrayLike) -> Array:
    """Return kappa, the ratio of major to minor semi-axis of the contact ellipse, to 1e-12.

    Parameters
    ----------
    radius_ratio : array
        Larger over smaller relative radius of curvature, at least 1.

    Raises
    ------
    InputError
        If a ratio is below 1 or not finite.
    """
    ratio = np.asarray(radius_ratio, dtype=float)
    if not np.all((ratio >= 1) & np.isfinite(ratio)):
        raise InputError("the ratio of relative radii must be finite and at least 1: larger over smaller")
    target = np.log(ratio)
    log_kappa = target * (2 / math.pi)
    for _ in range(30):
        m1 = np.exp(-2 * log_kappa)
        b, d = _elliptic_integrals(m1)
        m = 1 - m1
        # d ln(B/(m1 D)) / d ln kappa, from B' = (D - B)/2m and D' = (B - m1 D)/(2 m m1); 3/2 at the circle
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.where(m < 1e-6, 1.5, 2 + (m1 * (d - b) / b - (b - m1 * d) / d) / m)
        step = (np.log(b / (m1 * d)) - target) / slope
        log_kappa = np.maximum(log_kappa - step, 0.0)
        if np.all(np.abs(step) <= 1e-14 * (1 + log_kappa)):
            break
    return np.exp(log_kappa)


def _elliptic_integrals(m1: ArrayLike) -> tuple[Array, Array]:
    """Return B and D of the complementary parameter m1."""
    from scipy.special import elliprd  # slow to import, and not needed for a bearing of stated stiffness

    m1 = np.asarray(m1, dtype=float)
    return m1 * elliprd(0.0, 1.0, m1) / 3, elliprd(0.0, m1, 1.0) / 3


@dataclass(frozen=True)
class PointContact:
    """An elliptical contact.

    Attributes
    ----------
    radius_x, radius_y : float
        Relative radii of curvature along rolling and across, m (1/R = 1/R_1 + 1/R_2, concave radii negative).
    modulus : float
        Effective modulus E', Pa.

    Raises
    ------
    InputError
        If a relative radius is not positive and finite: the surfaces conform, and there is no Hertz ellipse.
    """

    radius_x: float
    radius_y: float
    modulus: float

    def __post_init__(self) -> None:
        for name, value in (("along rolling", self.radius_x), ("across rolling", self.radius_y)):
            if not (value > 0 and math.isfinite(value)):
                raise InputError(
                    f"relative radius of curvature {name} is {value:g} m; a point contact needs positive finite ones:"
                    " check the conformity (above 0.5) and the diameters"
                )

    @cached_property
    def kappa(self) -> float:
        """Ratio of major to minor semi-axis of the ellipse."""
        return float(ellipticity(max(self.radius_x, self.radius_y) / min(self.radius_x, self.radius_y)))

    @cached_property
    def integrals(self) -> tuple[float, float]:
        """Complete elliptic integrals of the first and of the second kind, K(m) and E(m), m = 1 - 1/kappa^2."""
        m1 = self.kappa**-2
        b, d = _elliptic_integrals(m1)
        return float(b + d), float(b + m1 * d)

    @property
    def radius(self) -> float:
        """R of 1/R = 1/R_x + 1/R_y, m."""
        return 1 / (1 / self.radius_x + 1 / self.radius_y)

    @cached_property
    def stiffness(self) -> float:
        """K of Q = K approach^(3/2), N/m^1.5."""
        first, second = self.integrals
        return math.pi * self.kappa * self.modulus * math.sqrt(self.radius * second / (4.5 * first**3))

    def semi_axes(self, load: ArrayLike) -> tuple[Array, Array]:
        """Return the semi-axes along rolling and across it, m, for loads in N (0 where there is no load)."""
        load = _positive_part(load)
        _, second = self.integrals
        major = np.cbrt(6 * self.kappa**2 * second * load * self.radius / (math.pi * self.modulus))
        minor = major / self.kappa
        return (minor, major) if self.radius_y >= self.radius_x else (major, minor)

    def peak_pressure(self, load: ArrayLike) -> Array:
        """Return the greatest pressure, Pa, for loads in N (0 where there is no load)."""
        load = _positive_part(load)
        _, second = self.integrals
        # 3 Q/(2 pi a b) with the semi-axes substituted
        unit = np.cbrt(6 * self.kappa**2 * second * self.radius / (math.pi * self.modulus))
        return np.asarray(1.5 * self.kappa / (math.pi * unit**2) * np.cbrt(load))


def point_contact(
    radii_first: tuple[float, float], radii_second: tuple[float, float], first: Material, second: Material
) -> PointContact:
    """Return the contact of two bodies from their radii of curvature (along rolling, across it).

    Radii in m: negative where concave, `math.inf` where straight.
    """
    curvature = [1 / a + 1 / b for a, b in zip(radii_first, radii_second, strict=True)]
    radius_x, radius_y = (1 / c if c != 0 else math.inf for c in curvature)
    return PointContact(radius_x, radius_y, effective_modulus(first, second))


def series_stiffness(*stiffnesses: float) -> float:
    """Return the stiffness of point contacts in series, N/m^1.5: their K^(-2/3) add up."""
    return math.fsum(stiffness ** (-2 / 3) for stiffness in stiffnesses) ** -1.5


@dataclass(frozen=True)
class BearingGeometry:
    """Catalogue geometry of a ball bearing.

    Attributes
    ----------
    ball_diameter, pitch_diameter : float
        m.
    inner_conformity, outer_conformity : float
        Groove radius over ball diameter, between 0.5 and 1; 0.515 to 0.53 is usual.
    contact_angle : float
        rad; 0 for a deep groove bearing without axial load.
    ball, race : Material
        `SILICON_NITRIDE` balls make a hybrid bearing.

    Raises
    ------
    InputError
        If the parts cannot make a bearing.
    """

    ball_diameter: float
    pitch_diameter: float
    inner_conformity: float = 0.52
    outer_conformity: float = 0.52
    contact_angle: float = 0.0
    ball: Material = BEARING_STEEL
    race: Material = BEARING_STEEL

    def __post_init__(self) -> None:
        if not 0 < self.ball_diameter < self.pitch_diameter:
            raise InputError(
                f"ball diameter {self.ball_diameter * 1e3:g} mm must be positive and smaller than the pitch diameter"
                f" {self.pitch_diameter * 1e3:g} mm"
            )
        for name, value in (("inner", self.inner_conformity), ("outer", self.outer_conformity)):
            if not 0.5 < value < 1:
                raise InputError(
                    f"{name} conformity {value:g} is not between 0.5 and 1; it is groove radius over ball diameter"
                )
        if not 0 <= self.contact_angle < math.pi / 2:
            raise InputError(f"contact angle {math.degrees(self.contact_angle):g} deg is not between 0 and 90 deg")

    def _contact(self, race_diameter: float, conformity: float) -> PointContact:
        ball = self.ball_diameter / 2
        groove = conformity * self.ball_diameter
        # at the contact angle the race's radius of curvature along rolling is greater by 1/cos
        race = race_diameter / (2 * math.cos(self.contact_angle))
        return point_contact((ball, ball), (race, -groove), self.ball, self.race)

    @cached_property
    def inner(self) -> PointContact:
        """Contact of a ball with the inner race."""
        across = self.ball_diameter * math.cos(self.contact_angle)
        return self._contact(self.pitch_diameter - across, self.inner_conformity)

    @cached_property
    def outer(self) -> PointContact:
        """Contact of a ball with the outer race."""
        across = self.ball_diameter * math.cos(self.contact_angle)
        return self._contact(-(self.pitch_diameter + across), self.outer_conformity)

    @property
    def stiffness(self) -> float:
        """Stiffness of one ball between both races, N/m^1.5."""
        return series_stiffness(self.inner.stiffness, self.outer.stiffness)


def _positive_part(value: ArrayLike) -> Array:
    return np.maximum(np.asarray(value, dtype=float), 0.0)
