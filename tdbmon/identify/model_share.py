"""What an ensemble says of a quantity, with what the model itself leaves: one share for forces and all that follows from them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from tdbsim.fatigue import EXPONENT

from tdbmon.estimate import Z95, Estimate
from tdbmon.quantity import percent

# of a force, standard deviation: modes and steps leave 0.3 %, the rest is left to the law of the contact
FORCE = 0.01
STRESS = FORCE / 3  # Hertz: a ball's pressure grows with the cube root of its load
FATIGUE = EXPONENT * STRESS
# counted on the two pages that it names: `tests/test_project.py` holds it to them
FORCES_HOLD = (
    f"The intervals of greatest forces hold what the fit leaves open and {percent(FORCE)} (standard deviation) for the law of"
    " contact, and so not always the true force: on synthetic drops of two other programs 388 of 400 did (docs/fitted_forces.md)"
    " and 9 of 12 (docs/forces.md); the other 3 of these were stated 4.6 to 8.1 % too high"
)

MEMBERS = 39  # of an ensemble: a further draw lies within the least and the greatest of them with 95 %
_BAND = (0.025, 0.5, 0.975)


def band(values: NDArray[np.float64], axis: int | None = None) -> NDArray[np.float64]:
    """Return where a further draw lies with 95 %, and the median: low, median, high along a first axis.

    Of few draws the quantile that interpolates between the ranks (k - 1)/(n - 1) lies too near the median; these are k/(n + 1)
    (W. Weibull 1939), which a further draw passes that often.
    """
    return np.asarray(np.quantile(values, _BAND, axis=axis, method="weibull"))


def of_members(values: NDArray[np.float64], share: float, unit: str, rule: str) -> Estimate:
    """Return the median of an ensemble's greatest values (n,), its 95 % band widened by a share that the model leaves.

    Parameters
    ----------
    values : (n,) array
        One a member, SI, not negative.
    share : float
        Of the median, standard deviation: `FORCE` or `STRESS`.
    unit, rule : str
        As in `Estimate`.
    """
    low, middle, high = band(values).tolist()
    model = Z95 * share * middle
    least, most = max(middle - math.hypot(middle - low, model), 0.0), middle + math.hypot(high - middle, model)
    return Estimate(middle, least, most, unit, rule, "", "0-pk")
