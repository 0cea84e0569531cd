"""Bandwidth check of the displacement channels: a low-pass filter in the data acquisition delays and smooths transients.

The noise of an unfiltered channel extends to several kilohertz; after a low-pass filter it does not.  Magnetic bearings excite
the shaft more at a few hundred hertz than above, so only a steep roll-off of the noise indicates a filter.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

from tdbmon.record.finding import Check
from tdbmon.record.levitated_lines import levitated_lines

_SLOW_HZ = (200.0, 500.0)  # above the leakage from the 1X line of a large orbit
_LOW = 0.25  # quantile of the power in this band, robust against spectral lines
_FAST_HZ = (2000.0, 5000.0)  # needed for release and contacts, and still within the bandwidth of probe drivers
_FAST_SHARE = (0.25, 0.45)  # of the sampling rate: the same band for slow records, below their own anti-alias filter
_LEAST_HZ = 1000.0  # lowest start of this band: below, a lack of bandwidth has no effect on the fall
_FALLS_OFF = 1e-3  # power ratio: 30 dB per decade; in the synthetic records a third of the noise power remains


def check_bandwidth(ds: xr.Dataset, machine: Machine) -> list[Check]:
    """Return a failed check if the noise of a probe before the fall rolls off too steeply above about a kilohertz."""
    lines = levitated_lines(ds, machine)
    if lines is None:
        return []
    rate = 2 * float(lines.hz[-1])
    begin, end = (min(hz, share * rate) for hz, share in zip(_FAST_HZ, _FAST_SHARE, strict=True))
    if begin < _LEAST_HZ:
        return []
    slow, fast = ((lines.hz > low) & (lines.hz < high) for low, high in (_SLOW_HZ, (begin, end)))
    usual = np.quantile(lines.each[:, slow], _LOW, axis=1)
    share = np.median(lines.each[:, fast], axis=1) / np.maximum(usual, 1e-300)
    if not np.any(filtered := share < _FALLS_OFF):
        return []
    detail = (
        f"before the fall, the noise power of {np.sum(filtered)} of {len(share)} displacement channels at {begin / 1e3:.3g} to"
        f" {end / 1e3:.3g} kHz is down to {share.min():.2g} of that at {_SLOW_HZ[0]:g} to {_SLOW_HZ[1]:g} Hz: a low-pass filter"
        " seems active. It delays release and contacts and makes contacts softer and longer; switch off the filter of the data"
        f" acquisition, or set it to {begin / 1e3:.3g} kHz or more"
    )
    return [Check("bandwidth", "", False, detail)]
