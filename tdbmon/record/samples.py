"""Access to the times and the finite samples of a channel."""

from __future__ import annotations

import numpy as np
import xarray as xr


def times_of(channel: xr.DataArray) -> np.ndarray:
    """Return the times of a channel's samples (n,), s."""
    return channel[channel.dims[0]].to_numpy()


def known_samples(channel: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """Return times, s, and values of the finite samples of a channel."""
    known = np.isfinite(channel.to_numpy())
    return times_of(channel)[known], channel.to_numpy()[known]
