"""Spikes of a speed signal: isolated values far beyond all others, caused by interference or counter errors."""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbmon.quantity import counted
from tdbmon.record.finding import Check

_BEYOND = 5.0  # times the rotor's speed: impossible from one sample to the next
_UPPER = 0.9  # quantile of the values used as typical, also in a coast-down
_HEAD = 0.01  # of the record at its start, where the speed is highest
_FEW = 0.05  # of the values: more are not spikes


def spiked(values: np.ndarray) -> np.ndarray:
    """Return a mask of the values of a speed signal (n,) that are spikes."""
    known = np.isfinite(values)
    size = np.abs(values)
    if not known.any():
        return known
    size_known = size[known]
    head = float(np.median(size_known[: max(1, round(_HEAD * size_known.size))]))
    if float(size_known.max()) <= _BEYOND * head:
        return np.zeros_like(known)
    usual = max(float(np.quantile(size_known, _UPPER)), head)
    found = known & (size > _BEYOND * usual)
    return found if usual > 0 and found.sum() <= _FEW * known.sum() else np.zeros_like(known)


def without_speed_spikes(ds: xr.Dataset) -> xr.Dataset:
    """Return a record with the spikes of its speed signal set to NaN."""
    if "speed" not in ds:
        return ds
    speed = ds["speed"]
    found = spiked(speed.values)
    return ds.assign(speed=(speed.dims, np.where(found, np.nan, speed.values), speed.attrs)) if found.any() else ds


def check_speed_spikes(ds: xr.Dataset) -> list[Check]:
    """Return a failed check with the number of spikes of the speed signal, if there are any."""
    values = ds["speed"].values
    found = spiked(values)
    if not found.any():
        return []
    usual = float(np.max(np.abs(values[np.isfinite(values) & ~found])))
    detail = (
        f"{counted(int(found.sum()), 'value')} of up to {float(np.max(np.abs(values[found]))):.4g} Hz, all others at most"
        f" {usual:.4g} Hz: spikes, taken as missing; check the cable's screen"
    )
    return [Check("spikes", "speed", False, detail)]
