"""Displacement at the bearing planes, made from closed forms for the tests of the analysis."""

from __future__ import annotations

import numpy as np
import xarray as xr

G = 9.80665


def planes_of(time: np.ndarray, xy: dict[str, np.ndarray]) -> xr.Dataset:
    """Wrap (n, 2) displacement an end, m, in the form of `to_planes`."""
    ends = list(xy)
    data = np.stack([np.asarray(xy[end]).T for end in ends])
    return xr.Dataset(
        {"displacement": (("end", "axis", "time"), data), "plane": (("end",), ["bearing"] * len(ends))},
        coords={"end": ends, "axis": ["x", "y"], "time": time},
        attrs={"sampling_hz": (len(time) - 1) / (time[-1] - time[0])},
    )
