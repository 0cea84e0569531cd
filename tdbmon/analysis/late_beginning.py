"""Test whether the first contact in a record that begins after the release is the first one of the drop."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from tdbmon.analysis.gap import Gap, NoCircle

_HEAD_S = 1e-3  # at the start of the record, for the initial position
# of the radius: a shaft so near to the centre has just left levitation (zone A of ISO 14839-2 ends there)
_LEVITATED = 0.3
_PERHAPS = "the record begins after the release, and perhaps after the first contact"


def late_beginning(planes: xr.Dataset, circles: Mapping[str, Gap | NoCircle]) -> str:
    """Return why the first contact in a record without a release may not be the first of the drop; "" if it is.

    It is if the shaft still falls from levitation: near the clearance centre at every visible end.  A shaft that rebounds
    from the ring may pass there at one end for a moment, but not at all ends.
    """
    time = planes.time.to_numpy()
    head = time < time[0] + _HEAD_S
    for end, gap in circles.items():
        if isinstance(gap, NoCircle):
            return _PERHAPS
        xy = planes.displacement.sel(end=end).to_numpy()[:, head]
        if not np.isfinite(xy).all(axis=0).any():
            return _PERHAPS
        away = np.nanmedian(np.hypot(*(xy - gap.place[:, None])))
        if away > _LEVITATED * gap.size:
            return _PERHAPS
    return ""
