"""A speed signal that comes late: a tachometer or a controller that averages shows a falling speed after it has fallen.

Its ratio to the keyphasor's speed is 1 while the levitated shaft turns steadily, and more from when it slows.  Taken for a scale,
that ratio would make the speed before the drop too low.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.record.keyphasor import Pulses, speed, stated_over_counted

_FIRST = 10  # turns at the start
_FEWEST = 4  # of them, and of those after
_NEAR = 0.9  # of the first speed: further down a zero that is off changes the ratio too
_LATE = 0.01  # of the speed: so much more than at first is no scatter
_CLEARLY = 5.0  # standard deviations


def lag(ds: xr.Dataset, marks: Pulses | None) -> float | None:
    """Return how many times more a speed signal reads, over the keyphasor, once the rotor slows; None where it keeps up.

    Nothing is said where pulses were missed or too many: then the keyphasor may be what is wrong.
    """
    if marks is None or marks.missed or marks.extra or "speed" not in ds:
        return None
    _, hz, _ = speed(marks)
    if not hz.size:
        return None
    ratio, _ = stated_over_counted(ds, marks, _NEAR * float(np.median(hz[:_FIRST])))
    few = min(_FIRST, ratio.size // 3)
    first, later = ratio[:few], ratio[few + (ratio.size - few) // 2 :]
    if few < _FEWEST or later.size < _FEWEST:
        return None
    more = float(np.median(later) / np.median(first))
    sigma = float(np.hypot(_error(first), _error(later)))
    return more if more - 1 > max(_LATE, _CLEARLY * sigma) else None


def _error(ratio: np.ndarray) -> float:
    """Return the standard error of a median, by the median deviation."""
    return 1.2533 * 1.4826 * float(np.median(np.abs(ratio - np.median(ratio)))) / np.sqrt(ratio.size)
