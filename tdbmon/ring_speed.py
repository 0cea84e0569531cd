"""Whether an inner ring turns with the journal, judged by their surface speeds rather than their angular speeds.

A ring that rolls without slip turns more slowly than the shaft, by the gap over the radius.  A ring faster than a decelerating
journal has reached its speed before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SLIPS = 0.02  # of the journal's surface speed: greatest slip of a ring that counts as turning with it


def turns_along(
    ring: NDArray[np.float64], shaft: NDArray[np.float64], journal: float, bore: float
) -> NDArray[np.bool_]:
    """Return a mask (k,) of samples at which a ring turns with the journal or faster, in the same sense; False at standstill.

    Parameters
    ----------
    ring, shaft : (k,) array
        Angular speeds of inner ring and shaft, in the same unit.
    journal, bore : float
        Contact radii of journal and ring, m.
    """
    return (shaft != 0.0) & (np.sign(shaft) * ring * bore >= (1 - SLIPS) * np.abs(shaft) * journal)
