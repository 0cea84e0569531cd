"""Detection of a lagging speed signal: an averaging tachometer or controller reads too high during coast-down.

Its ratio to the keyphasor speed is 1 at constant speed in levitation and larger during coast-down.  Interpreted as a scale
error, that ratio would make the speed before the drop too low.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.record.keyphasor import Pulses, speed, stated_over_counted

_FIRST = 10  # revolutions at the start
_FEWEST = 4  # fewest revolutions at the start, and after it
_NEAR = 0.9  # of the initial speed: at lower speeds an offset of the signal changes the ratio too
_LATE = 0.01  # relative increase of the ratio that exceeds its scatter
_CLEARLY = 5.0  # standard deviations of the increase


def lag(ds: xr.Dataset, marks: Pulses | None) -> float | None:
    """Return the factor by which the ratio of speed signal to keyphasor speed rises in coast-down; None if it does not.

    None also if there are missed or surplus pulses, as the keyphasor itself may then be at fault.
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
    """Return the standard error of a median, from the median absolute deviation."""
    return 1.2533 * 1.4826 * float(np.median(np.abs(ratio - np.median(ratio)))) / np.sqrt(ratio.size)
