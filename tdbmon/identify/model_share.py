"""Estimates from an ensemble, widened by a relative model error: one for forces and all quantities that follow from them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from tdbsim.fatigue import EXPONENT

from tdbmon.estimate import Z95, Estimate
from tdbmon.quantity import percent

# relative standard deviation of a force: 0.3 % for modes and step size, the rest for the law of the contact
FORCE = 0.01
STRESS = FORCE / 3  # Hertz: a ball's pressure grows with the cube root of its load
FATIGUE = EXPONENT * STRESS
# numbers from the two pages that it names: `tests/test_project.py` compares them
FORCES_HOLD = (
    f"The intervals of greatest forces include the uncertainty of the fit and {percent(FORCE)} (standard deviation) for the law"
    " of contact. They do not always contain the true force: on synthetic drops of two other programs 388 of 400 did"
    " (docs/fitted_forces.md) and 9 of 12 (docs/forces.md); the other 3 of these were stated 4.6 to 8.1 % too high"
)

MEMBERS = 39  # of an ensemble: a further draw lies between the least and the greatest with probability 95 %
_BAND = (0.025, 0.5, 0.975)


def band(values: NDArray[np.float64], axis: int | None = None) -> NDArray[np.float64]:
    """Return the 95 % prediction band for a further draw, and the median: low, median, high along a first axis.

    For few draws, quantiles interpolated between the plotting positions (k - 1)/(n - 1) lie too near the median; k/(n + 1)
    (W. Weibull 1939) is the probability with which a further draw lies below the k-th.
    """
    return np.asarray(np.quantile(values, _BAND, axis=axis, method="weibull"))


def of_members(values: NDArray[np.float64], share: float, unit: str, rule: str) -> Estimate:
    """Return the median of an ensemble's greatest values (n,), its 95 % band widened by the model error.

    Parameters
    ----------
    values : (n,) array
        One per member, SI, not negative.
    share : float
        Standard deviation of the model error relative to the median: `FORCE` or `STRESS`.
    unit, rule : str
        As in `Estimate`.
    """
    low, middle, high = band(values).tolist()
    model = Z95 * share * middle
    least, most = max(middle - math.hypot(middle - low, model), 0.0), middle + math.hypot(high - middle, model)
    return Estimate(middle, least, most, unit, rule, "", "0-pk")
