"""When an inner ring has come to turn with the journal: by the speed of their surfaces, not by revolutions.

A ring that rolls without slip turns more slowly than the shaft, by the gap over the radius.  One that overtakes a journal which
has slowed down came to its speed before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SLIPS = 0.02  # of the journal's surface speed: a ring that lags by less turns with it


def turns_along(
    ring: NDArray[np.float64], shaft: NDArray[np.float64], journal: float, bore: float
) -> NDArray[np.bool_]:
    """Return where (k,) a ring turns with the journal or faster, and the same way round; nowhere where the shaft stands.

    Parameters
    ----------
    ring, shaft : (k,) array
        Angular speeds of inner ring and shaft, in one unit.
    journal, bore : float
        Radii on which they touch, m.
    """
    return (shaft != 0.0) & (np.sign(shaft) * ring * bore >= (1 - SLIPS) * np.abs(shaft) * journal)
