"""Radius at rest as the sum of air gap, ball clearance, and the deflections of contact, balls and support.

With the static load W on an end the shaft centre rests at the radius

    c  +  (W / K)^(1/n)  +  e_b(W)  +  W / k

where c is the radial air gap, K and n are stiffness and exponent of the Hunt-Crossley contact, k is the support stiffness
and e_b the displacement of the inner ring at which the balls carry W: sum_j K_b (e_b cos b_j - c_d/2)^1.5 cos b_j = W
over the loaded balls, averaged over the cage angle.  e_b includes half of the diametral clearance c_d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from tdbsim.machine import TouchdownBearing
from tdbsim.power_law import static_depth

_CAGE_ANGLES = 16


@dataclass(frozen=True)
class RestTravel:
    """Displacement of the shaft centre beyond the air gap under the static load of an end, m.

    Attributes
    ----------
    contact, balls, support : float
        Contributions at the machine file's nominal values; `balls` includes half of the diametral clearance.
    sigma : float
        Standard deviation of their sum due to the stated tolerances (a tolerance is taken as two standard deviations).
    per_load : float
        Derivative of the sum with respect to the relative load (m for a doubling of the load, linearised).
    """

    contact: float
    balls: float
    support: float
    sigma: float
    per_load: float

    @property
    def total(self) -> float:
        """Sum of the contributions, m."""
        return self.contact + self.balls + self.support


def rest_travel(bearing: TouchdownBearing, load: float) -> RestTravel:
    """Return the displacement beyond the air gap at a static load, N, with the machine file's values and tolerances."""
    clearance, stiffness = bearing.balls.diametral_clearance, bearing.support_stiffness
    contact, balls, support = _parts(bearing, load)
    clearance_sigma = (clearance.high - clearance.low) / 4 / 2
    support_sigma = support * (stiffness.high - stiffness.low) / 4 / stiffness.nominal
    h = 0.02
    steeper = ball_travel(bearing, load * (1 + h), clearance.nominal)
    per_load = contact / bearing.contact_exponent + (steeper - balls) / h + support
    return RestTravel(contact, balls, support, float(np.hypot(clearance_sigma, support_sigma)), per_load)


def path_radius(bearing: TouchdownBearing, travel: float) -> float:
    """Return the radius of the circle on which the shaft centre rolls, m; `travel` is its displacement beyond the air gap, m."""
    return bearing.radial_gap.nominal + travel


def rolling_mass(bearing: TouchdownBearing) -> float:
    """Return the effective mass, kg, that the inner ring adds to sideways motion, as it rotates with the rolling shaft."""
    return bearing.inner_ring_inertia / bearing.journal_radius**2


def total_travel(bearing: TouchdownBearing, load: float) -> float:
    """Return only the sum of the contributions of `rest_travel`, m."""
    contact, balls, support = _parts(bearing, load)
    return contact + balls + support


def _parts(bearing: TouchdownBearing, load: float) -> tuple[float, float, float]:
    contact = static_depth(load, bearing.contact_stiffness, bearing.contact_exponent)
    balls = ball_travel(bearing, load, bearing.balls.diametral_clearance.nominal)
    return contact, balls, load / bearing.support_stiffness.nominal


def ball_travel(bearing: TouchdownBearing, load: float, diametral_clearance: float) -> float:
    """Return the displacement of the inner ring at which the balls carry a load, m (mean over the cage angle)."""
    balls, stiffness = bearing.balls, bearing.ball_stiffness
    cage = np.arange(_CAGE_ANGLES) / _CAGE_ANGLES * 2 * np.pi / balls.count
    cosine = np.cos(cage[:, None] + 2 * np.pi * np.arange(balls.count) / balls.count)

    def carried(travel: np.ndarray) -> np.ndarray:
        deflection = np.maximum(travel[:, None] * cosine - diametral_clearance / 2, 0.0)
        return np.sum(stiffness * deflection**1.5 * cosine, axis=1)

    play = max(diametral_clearance, 0.0)  # preloaded balls carry from the centre on: bracket as without clearance
    low = np.full(_CAGE_ANGLES, play / 2)
    high = low + 4 * (load / stiffness) ** (2 / 3) + play + 1e-9
    for _ in range(60):
        middle = 0.5 * (low + high)
        less = carried(middle) < load
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    return float(np.mean(0.5 * (low + high)))
