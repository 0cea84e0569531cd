"""What an ensemble says of a quantity, with what the model itself leaves: one share for forces and all that follows from them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from tdbsim.fatigue import EXPONENT

from tdbmon.estimate import Z95, Estimate

# of a force, standard deviation: modes and steps leave 0.3 %, the rest is left to the law of the contact
FORCE = 0.01
STRESS = FORCE / 3  # Hertz: a ball's pressure grows with the cube root of its load
FATIGUE = EXPONENT * STRESS

BAND = (0.025, 0.975)


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
    low, middle, high = (float(q) for q in np.quantile(values, (BAND[0], 0.5, BAND[1])))
    model = Z95 * share * middle
    least, most = max(middle - math.hypot(middle - low, model), 0.0), middle + math.hypot(high - middle, model)
    return Estimate(middle, least, most, unit, rule, "", "0-pk")
