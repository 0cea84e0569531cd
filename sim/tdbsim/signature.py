"""Features of a simulated drop, from which effects measure their signatures."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TOUCHING = 20.0  # N; least normal force of a contact


def after_release(drop: xr.Dataset, seconds: float = 0.0) -> xr.Dataset:
    """Return the part of a drop from some time after the release on."""
    return drop.isel(time=drop["time"].values >= float(drop.attrs["release_time_s"]) + seconds)


def before_release(drop: xr.Dataset) -> xr.Dataset:
    """Return the levitated part of a drop."""
    return drop.isel(time=drop["time"].values < float(drop.attrs["release_time_s"]) - 1e-12)


def bearings(drop: xr.Dataset, where: str) -> list[xr.Dataset]:
    """Return the drop at the end that `where` names, or at both ends."""
    return [drop.sel(end=end) for end in (drop["end"].values if where == "both" else [where])]


def order_phasor(values: Array, angle: Array, order: float) -> complex:
    """Return the complex 0-pk amplitude of a signal at a multiple of an angle, by a Hann-windowed projection."""
    window = np.hanning(len(values))
    centred = values - np.average(values, weights=window)
    return complex(2 * np.sum(window * centred * np.exp(-1j * order * angle)) / window.sum())


def contact_points(drop: xr.Dataset, end: str) -> tuple[Array, Array, Array]:
    """Return distance of the centres less the depth, azimuth and ring angle of the samples in contact."""
    at = drop.sel(end=end)
    touching = at["normal_force"].values > _TOUCHING
    x = (at["rotor_x"] - at["ring_x"]).values[touching]
    y = (at["rotor_y"] - at["ring_y"]).values[touching]
    distance = np.hypot(x, y) - at["depth"].values[touching]
    return distance, np.arctan2(y, x), at["ring_angle"].values[touching]


def lobes(distance: Array, azimuth: Array, order: int) -> float:
    """Return the 0-pk amplitude of the harmonic `order` of a distance over the azimuth, fitted by least squares."""
    columns = np.column_stack([np.ones_like(azimuth), np.cos(order * azimuth), np.sin(order * azimuth)])
    found = np.linalg.lstsq(columns, distance, rcond=None)[0]
    return float(np.hypot(found[1], found[2]))


def probe_axis(drop: xr.Dataset, probe: str) -> Array:
    """Return the sensitivity (x, y) of a probe to the shaft's motion in its plane, by least squares after the release."""
    at = after_release(drop).sel(probe=probe)
    motion = np.column_stack([at["shaft_x"], at["shaft_y"], np.ones(at.sizes["time"])])
    return np.asarray(np.linalg.lstsq(motion, at[probe].values, rcond=None)[0][:2])
