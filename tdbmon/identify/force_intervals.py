"""What the interval of a greatest force holds, and how often it held the true force where that is known."""

from __future__ import annotations

from tdbmon.identify.model_share import FORCE
from tdbmon.quantity import percent

# counted on the two pages that it names: `tests/test_project.py` holds it to them
FORCES_HOLD = (
    f"The intervals of greatest forces hold what the fit leaves open and {percent(FORCE)} (standard deviation) for the law of"
    " contact, and so not always the true force: on synthetic drops of two other programs 388 of 400 did (docs/fitted_forces.md)"
    " and 9 of 12 (docs/forces.md); the other 3 of these were stated 4.6 to 8.1 % too high"
)
