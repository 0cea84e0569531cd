"""Conversion of any Dataset, e.g. from `xarray.open_dataset` or a script, to the form of a record."""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.errors import InputError

from tdbmon.record.channel import full_scale_of, si_unit
from tdbmon.record.timebase import moments, time_factor


def as_record(ds: xr.Dataset) -> xr.Dataset:
    """Return a Dataset with channels in SI and times in s, as `tdbmon.record.read` would have read them.

    Channels are converted to SI where ``units`` is known, and the packing of converter codes that `xarray` has unpacked gives
    the full scale.  Dates become seconds since the earliest one.  Data already in this form are returned unchanged.

    Raises
    ------
    InputError
        If a channel is not one-dimensional, or its dimension has no strictly increasing time coordinate.
    """
    source = str(ds.attrs.get("source_file", "dataset"))
    for name, array in ds.data_vars.items():
        if array.ndim != 1 or array.dtype.kind not in "biuf":
            raise InputError(
                f"{source}: '{name}' of type {array.dtype} with dimensions {array.dims} is not a channel; give numbers along one"
                " time dimension"
            )
    times = {dimension: _time(ds, str(dimension), source) for dimension in ds.sizes}
    dates = [time.values.min() for time in times.values() if time.dtype.kind == "M" and time.size]
    seconds = {dimension: _seconds(time, min(dates, default=None)) for dimension, time in times.items()}
    for dimension, values in seconds.items():
        back = np.flatnonzero(~(np.diff(values) > 0))
        if back.size:
            raise InputError(
                f"{source}: the time '{dimension}' does not increase after sample {back[0] + 1} ({values[back[0]]:.9g} s);"
                " sort the dataset by it, and remove duplicates"
            )
    moved = {
        dimension: (dimension, values, {**times[dimension].attrs, "units": "s"})
        for dimension, values in seconds.items()
        if values is not times[dimension].values
    }
    channels = {name: _in_si(array).variable for name, array in ds.data_vars.items()}
    return ds.assign(channels).assign_coords(moved)


def _time(ds: xr.Dataset, dimension: str, source: str) -> xr.DataArray:
    if dimension not in ds.coords:
        raise InputError(
            f"{source}: the dimension '{dimension}' has no coordinate; give it the times of the samples, e.g."
            f' ds.assign_coords({dimension}=np.arange(ds.sizes["{dimension}"]) / 20e3) at 20 kHz'
        )
    time = ds[dimension]
    if time.dtype.kind not in "Mmiuf" or (time.dtype.kind in "iuf" and _factor(time) is None):
        held = f"in '{time.attrs['units']}'" if time.dtype.kind in "iuf" else f"of type {time.dtype}"
        raise InputError(
            f"{source}: the coordinate '{dimension}' is {held}; give the times of the samples in s, or as dates"
        )
    counted = moments(time.values, str(time.attrs.get("units", ""))) if time.dtype.kind in "iu" else None
    return time if counted is None else xr.DataArray(counted, dims=time.dims, attrs=time.attrs)


def _factor(time: xr.DataArray) -> float | None:
    return time_factor(str(time.attrs.get("units", "s")))


def _seconds(time: xr.DataArray, first: np.datetime64 | None) -> np.ndarray:
    values = time.values
    if values.dtype.kind in "Mm":
        since = values - first if values.dtype.kind == "M" else values
        return np.asarray(since / np.timedelta64(1, "s"))
    factor = _factor(time) or 1.0
    return values if factor == 1.0 and values.dtype == np.float64 else values.astype(np.float64) * factor


def _in_si(array: xr.DataArray) -> xr.DataArray:
    written = str(array.attrs.get("units", ""))
    units, factor = si_unit(written)
    packed = {"scale_factor", "dtype"} <= array.encoding.keys() and np.dtype(array.encoding["dtype"]).kind in "iu"
    if units == written and array.dtype == np.float64 and not (packed and "full_scale" not in array.attrs):
        return array
    values = array.values.astype(np.float64)
    out = array.copy(data=values * factor if factor != 1.0 else values)
    out.encoding = {}
    out.attrs = {"source_units": written, **array.attrs, "units": units}
    limits = array.attrs.get("full_scale")
    if limits is None and packed:
        scale, offset = (
            float(array.encoding.get(key, unset)) for key, unset in (("scale_factor", 1.0), ("add_offset", 0.0))
        )
        limits = full_scale_of(np.dtype(array.encoding["dtype"]), scale, offset)
    if limits is not None:
        out.attrs["full_scale"] = [float(limit) * factor for limit in limits]
    return out
