"""A record that begins after the release: whether its first contact can be the drop's first one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from tdbmon.analysis.gap import Gap, NoCircle

_HEAD_S = 1e-3  # of the record, that shows where it begins
# of the radius: a shaft so near to the centre comes from levitation (zone A of ISO 14839-2 ends there)
_LEVITATED = 0.3
_PERHAPS = "the record begins after the release, and perhaps after the first contact"


def late_beginning(planes: xr.Dataset, circles: Mapping[str, Gap | NoCircle]) -> str:
    """Return why the first contact that a record without a release shows may not be the first; "" where it is.

    It is where the shaft still falls from levitation: near the clearance centre at every end that is seen.  A shaft that
    is thrown back from the ring may come there at one end for a moment, not at all.
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
