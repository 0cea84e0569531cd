"""netCDF, classic and version 4, the format in which records are written."""

from __future__ import annotations

import re
from datetime import datetime, time
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
import xarray as xr

from tdbmon.atomic import replacing
from tdbmon.record.channel import Channel, Content, full_scale_of
from tdbmon.record.date import first_dated
from tdbmon.record.formats.hdf5 import HDF5_MAGIC
from tdbmon.record.formats.stored_size import check_size
from tdbmon.record.timebase import interval_of, is_time_name, moments, time_factor
from tdbmon.record.tree import stated_date, stated_title

_FIRST_YEAR = 1980  # earlier dates are not recordings but epochs, possibly in local time (1970-01-01 01:00)


class NetCDF:
    """netCDF files: one-dimensional variables are channels, and the dimension's coordinate variable is their time."""

    name = "netCDF"
    extra: str | None = None

    def recognises(self, head: bytes, path: Path) -> bool:
        if re.match(rb"CDF[\x01\x02\x05]", head):
            return True
        return head.startswith(HDF5_MAGIC) and _has_netcdf_marks(path)

    def read(self, path: Path) -> Content:
        _check_classic(path)
        with netCDF4.Dataset(path, "r") as file:
            file.set_auto_maskandscale(False)
            check_size(_stored_bytes(file), path, compressed=not file.data_model.startswith("NETCDF3"))
            channels = tuple(_channels(file))
            stated = _attributes(file)
            date = first_dated((stated_date(stated), _began(file)))
            machine = str(getattr(file, "machine", "")).strip()
            return Content(channels, stated_title(stated), date, machine=machine, beside=_beside(file))


def write_netcdf(record: xr.Dataset, path: Path) -> None:
    """Write a record so that reading it returns identical values; the file appears complete or not at all.

    Raises
    ------
    InputError
        If the path cannot be written, or the disk is full.
    """
    with replacing(path) as part:
        try:
            with netCDF4.Dataset(part, "w") as file:
                _fill(file, record)
        except RuntimeError as error:  # raised by the library if the disk is full
            raise OSError(f"{error}; is the disk full?") from None


def _fill(file: netCDF4.Dataset, record: xr.Dataset) -> None:
    for dimension in record.sizes:
        file.createDimension(str(dimension), record.sizes[dimension])
    for name in record.variables:
        _write_variable(file, str(name), record[name])
    for name, value in record.attrs.items():
        if isinstance(value, (str, int, float)) and value != "":
            file.setncattr(str(name), value)


def _check_classic(path: Path) -> None:
    """Reject a truncated classic file, which the library would silently pad with zeros."""
    with path.open("rb") as file:
        if file.read(4) not in (b"CDF\x01", b"CDF\x02"):
            return
    from scipy.io import netcdf_file

    with netcdf_file(path, "r", mmap=True):
        pass  # memory-maps every variable, and raises if the file is too short


def _has_netcdf_marks(path: Path) -> bool:
    try:
        with h5py.File(path, "r") as file:
            if "_NCProperties" in file.attrs:
                return True
            return any("_Netcdf4Dimid" in item.attrs for item in file.values())
    except Exception:  # a damaged file: the error is reported when it is read
        return False


def _channels(group: Any, prefix: str = "") -> list[Channel]:
    channels = []
    times: dict[str, np.ndarray] = {}
    stated = interval_of(_attributes(group))
    for name, variable in group.variables.items():
        if not _is_number(variable) or _is_time(group, name) or not _may_be_channel(group, variable):
            continue
        dimension = variable.dimensions[0]
        if dimension not in times:
            found = _time_of(group, dimension)
            if found is None:
                interval = interval_of(_attributes(variable)) or stated
                if interval is None:
                    untold = Channel(prefix + name, np.empty(0), fault="its sampling times are not given")
                    channels.append(untold)
                    continue
                found = interval * np.arange(variable.size)
            times[dimension] = found
        channels.append(_channel(prefix + name, variable, times[dimension]))
    for name, inner in group.groups.items():
        channels += _channels(inner, f"{prefix}{name}/")
    return channels


def _may_be_channel(group: Any, variable: Any) -> bool:
    """Return whether a variable has one dimension without text labels (such as the end names in a simulated drop)."""
    if len(variable.dimensions) != 1:
        return False
    node = group
    while node is not None:
        label = node.variables.get(variable.dimensions[0])
        if label is not None:
            return _is_number(label)
        node = node.parent
    return True


def _beside(group: Any, prefix: str = "") -> dict[str, str]:
    """Return the numeric variables that are not channels, with the names of their dimensions."""
    found = {
        prefix + name: ", ".join(variable.dimensions)
        for name, variable in group.variables.items()
        if variable.dimensions and _is_number(variable) and not _may_be_channel(group, variable)
    }
    for name, inner in group.groups.items():
        found |= _beside(inner, f"{prefix}{name}/")
    return found


def _stored_bytes(group: Any) -> int:
    own = sum(
        variable.size * np.dtype(variable.dtype).itemsize
        for variable in group.variables.values()
        if _is_number(variable)
    )
    return int(own) + sum(_stored_bytes(inner) for inner in group.groups.values())


def _attributes(item: Any) -> dict[str, Any]:
    return {name: item.getncattr(name) for name in item.ncattrs()}


def _is_number(variable: Any) -> bool:
    return isinstance(variable.dtype, np.dtype) and variable.dtype.kind in "iuf"


def _is_time(group: Any, name: str) -> bool:
    return name in group.variables[name].dimensions or (
        is_time_name(name) and time_factor(getattr(group.variables[name], "units", "")) is not None
    )


def _time_of(group: Any, dimension: str) -> np.ndarray | None:
    """Return the time along a dimension, from its coordinate variable or a variable named as time; None without any."""
    node = group
    while node is not None:
        for name, variable in node.variables.items():
            if variable.dimensions == (dimension,) and _is_number(variable) and _is_time(node, name):
                unit = str(getattr(variable, "units", ""))
                factor = time_factor(unit)
                if factor is not None:
                    raw, scale, offset, _ = _unpacked(variable)
                    counted = moments(raw, unit) if scale == 1.0 and offset == 0.0 else None
                    return counted if counted is not None else np.asarray(_physical(variable) * factor)
        node = node.parent
    return None


def _began(group: Any) -> str:
    """Return the first date-time of a time variable with an epoch in its units, in ISO 8601; "" without any.

    Exactly midnight, or a year before 1980, is taken for the epoch itself, i.e. for a time that merely starts at zero.
    """
    for name, variable in group.variables.items():
        units = str(getattr(variable, "units", ""))
        if " since " not in units or not _is_number(variable) or not variable.size or not _is_time(group, name):
            continue
        calendar = getattr(variable, "calendar", "standard")
        try:
            first = np.asarray(netCDF4.num2date(_physical(variable)[:1], units, calendar, False, True)).flat[0]
        except ValueError:  # the epoch is not a valid date
            continue
        if isinstance(first, datetime) and first.time() != time.min and first.year >= _FIRST_YEAR:
            return first.isoformat()
    return next((began for inner in group.groups.values() if (began := _began(inner))), "")


def _physical(variable: Any) -> np.ndarray:
    raw, scale, offset, _ = _unpacked(variable)
    return np.asarray(raw.astype(np.float64) * scale + offset)


def _unpacked(variable: Any) -> tuple[np.ndarray, float, float, np.dtype[Any]]:
    """Return stored values, scale, offset and stored type; values declared as missing become NaN.

    The default fill value of integers does not count as missing: -32767 is a valid code of a 16-bit converter.
    """
    raw = np.asarray(variable[...])
    if getattr(variable, "_Unsigned", "") == "true" and raw.dtype.kind == "i":
        raw = raw.view(raw.dtype.str.replace("i", "u"))
    scale, offset = float(getattr(variable, "scale_factor", 1.0)), float(getattr(variable, "add_offset", 0.0))
    codes = [code for name in ("_FillValue", "missing_value") for code in np.atleast_1d(getattr(variable, name, []))]
    if raw.dtype.kind == "f":
        codes.append(netCDF4.default_fillvals[raw.dtype.str[1:]])
    stored = raw.dtype
    missing = np.isin(raw, np.asarray(codes, dtype=raw.dtype)) if codes else np.zeros(raw.shape, dtype=bool)
    if missing.any():
        raw = raw.astype(np.float64)
        raw[missing] = np.nan
    return raw, scale, offset, stored


def _channel(name: str, variable: Any, time: np.ndarray) -> Channel:
    raw, scale, offset, stored = _unpacked(variable)
    full_scale = np.asarray(getattr(variable, "full_scale", []), dtype=np.float64)
    limits: tuple[float, float] | None = None
    if full_scale.shape == (2,):
        limits = (float(full_scale[0]), float(full_scale[1]))
    elif stored.kind in "iu" and scale != 1.0:
        limits = full_scale_of(stored, scale, offset)
    return Channel(
        name=name,
        values=raw,
        unit=str(getattr(variable, "units", "")),
        time=time,
        scale=scale,
        offset=offset,
        long_name=str(getattr(variable, "long_name", "")),
        full_scale=limits,
    )


def _write_variable(file: Any, name: str, array: xr.DataArray) -> None:
    values = np.asarray(array.values)
    if values.dtype.kind in "UO":  # text labels of a dimension
        file.createVariable(name, str, array.dims)[...] = values.astype(object)
        return
    stored, packing = _smallest_exact(values, array.encoding)
    # no fill value for integers: every code may be a measured value
    fill = False if stored.dtype.kind in "iu" else np.array(np.nan, dtype=stored.dtype)
    variable = file.createVariable(
        name, stored.dtype, array.dims, compression="zlib", complevel=4, shuffle=True, fill_value=fill
    )
    variable.set_auto_maskandscale(False)
    for key, value in {**array.attrs, **packing}.items():
        if isinstance(value, (str, int, float)) and value != "":
            variable.setncattr(str(key), value)
        elif key == "full_scale":
            variable.setncattr(key, np.asarray(value, dtype=np.float64))
    variable[...] = stored


def _smallest_exact(values: np.ndarray, encoding: dict[Any, Any]) -> tuple[np.ndarray, dict[str, float]]:
    """Return the values in the smallest type that reproduces them bit for bit, and the packing attributes."""
    if values.dtype.kind in "iu":
        return values, {}
    finite = np.isfinite(values)
    trials: list[tuple[np.dtype[Any], float, float]] = []
    if finite.all():
        scale, offset = float(encoding.get("scale_factor", 1.0)), float(encoding.get("add_offset", 0.0))
        if scale != 1.0:
            trials.append((np.dtype(encoding.get("dtype", np.int16)), scale, offset))
        trials.append((np.dtype(np.int8), 1.0, 0.0))
    for dtype, scale, offset in trials:
        if dtype.kind not in "iu":
            continue
        codes = np.rint((values - offset) / scale)
        limits = np.iinfo(dtype)
        if codes.size and limits.min <= codes.min() and codes.max() <= limits.max:
            back = codes * scale if scale != 1.0 else codes
            if np.array_equal(back + offset if offset else back, values):
                packing = {"scale_factor": scale, "add_offset": offset} if scale != 1.0 else {}
                return codes.astype(dtype), packing
    with np.errstate(over="ignore"):
        single = values.astype(np.float32)
    exact = np.array_equal(single.astype(np.float64)[finite], values[finite]) and bool(
        np.isfinite(single[finite]).all()
    )
    return (single if exact else values), {}
