"""Channels as stored in a file, and their conversion to a record."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.units import si_unit_of

from tdbmon.quantity import counted
from tdbmon.record.date import iso_date
from tdbmon.record.timebase import LONG
from tdbmon.sha256 import sha256_of

_COUNTED = "times repeat in the file: computed from its stated sampling rate instead"
_OR_RATE = ", or state the true rate in the file (as 'Sample rate [Hz]' above a table)"
_SHORTEST = 1e-7  # s between samples: no rotor is recorded at 10 MHz
_FEW = 0.01  # of the samples: if more time stamps repeat, their resolution is too coarse
_DRIFT = 1e-3  # largest relative deviation between a clock and the logger's sampling rate
_OVERLOAD = (9.89e37, 9.92e37)  # SCPI codes for overload (9.9e37) and for "no value" (9.91e37)
_ROUNDING = 1e-5  # of an interval: below this, unevenness is rounding of the time stamps


@dataclass(frozen=True)
class Channel:
    """One channel with its own time base, before any unit conversion.

    Parameters
    ----------
    name : str
        Name in the file.
    values : numpy.ndarray, shape (n,)
        Stored values; the physical value in `unit` is ``values * scale + offset``, NaN where the file has none.  Date-times
        (datetime64), here or in `time`, are converted to seconds since the earliest one in the file.
    unit : str
        Unit as in the file; "" if the file states none.
    start, interval : float
        Time of the first sample and sampling interval, s; used if `time` is None, the interval also if time stamps repeat.
    time : numpy.ndarray, shape (n,), optional
        Time of every sample, s or datetime64.
    scale, offset : float
        Scaling of packed values; integers with a scale other than 1 have a full scale.
    long_name : str
        Description of the channel in the file.
    full_scale : tuple of float, optional
        Smallest and largest value that the instrument can represent, in `unit`; derived for packed integers if not given.
    group : str
        Group of the file to which the channel belongs; "" if the file has none.
    stored : str
        Name under which the file stores the channel (``DAQ/AI0``) if `name` is a separate label; "" otherwise.
    fault : str
        Why the channel cannot be used (e.g. its sampling times are unknown), in words; it is then reported but not read.
    """

    name: str
    values: np.ndarray
    unit: str = ""
    start: float = 0.0
    interval: float | None = None
    time: np.ndarray | None = None
    scale: float = 1.0
    offset: float = 0.0
    long_name: str = ""
    full_scale: tuple[float, float] | None = None
    group: str = ""
    stored: str = ""
    fault: str = ""


@dataclass(frozen=True)
class Content:
    """Content of a file as returned by the reader of its format.

    `machine` is the name of the machine as stated in the file, if any.
    `incomplete` describes what is missing from a truncated file whose readable part is intact.
    `drop_time` is the date as stated in the file, whether or not it can be interpreted.
    `drop_time_from` describes what `drop_time` is, if it may differ from the time of the drop.
    `beside` maps numeric variables that are not channels to the dimensions along which they lie.
    """

    channels: tuple[Channel, ...]
    title: str = ""
    drop_time: str = ""
    incomplete: str = ""
    machine: str = ""
    drop_time_from: str = ""
    beside: Mapping[str, str] = field(default_factory=dict)


def to_dataset(content: Content, path: Path, reader: str) -> xr.Dataset:
    """Convert a file's channels to a record (its form is described in `tdbmon.record`).

    Parameters
    ----------
    content : Content
        The channels and the file's information about the record.
    path : pathlib.Path
        The file; its name and SHA-256 become the record's provenance.
    reader : str
        Name of the format.

    Returns
    -------
    xarray.Dataset
        Channels in SI on dimensions ``time``, ``time_2`` ...; packed channels keep their packing in ``encoding``.

    Raises
    ------
    InputError
        If there is no channel, two channels have the same name, or a time base does not increase.
    """
    channels = _in_seconds([channel for channel in content.channels if not channel.fault])
    left_out = {channel.name: channel.fault for channel in content.channels if channel.fault}
    if not channels:
        told = next((f" ('{name}': {fault})" for name, fault in left_out.items()), "")
        raise InputError(f"{path}: contains no channel over time{told}; give a file with at least one numeric channel")
    _unique(channels, path)
    bases = _TimeBases(channels, path)
    data: dict[str, xr.DataArray] = {}
    for channel in channels:
        data[_variable_name(channel.name)] = _variable(channel, bases.dimension_of(channel))
    dropped = iso_date(content.drop_time)
    always: dict[str, Any] = {
        "source_file": path.name,
        "sha256": sha256_of(path),
        "reader": reader,
        "title": content.title,
        "drop_time": dropped,
    }
    where_told = {
        "drop_time_unread": "" if dropped else content.drop_time,
        "drop_time_from": content.drop_time_from if dropped else "",
        "incomplete": content.incomplete,
        "machine": content.machine,
        "left_out": left_out,
        "beside": dict(content.beside),
    }
    attributes = always | {name: value for name, value in where_told.items() if value}
    return xr.Dataset(data, coords=bases.coordinates(), attrs=attributes)


def named_apart(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Return the channels with names that occur more than once prefixed by their group."""
    count = Counter(channel.name for channel in channels)
    return tuple(
        replace(channel, name=f"{channel.group}/{channel.name}")
        if channel.group and count[channel.name] > 1
        else channel
        for channel in channels
    )


def si_unit(unit: str) -> tuple[str, float]:
    """Return the SI unit of a channel and the conversion factor to it; the text itself and 1 if unknown or not stated."""
    text = unit.strip()
    if not text:
        return "", 1.0
    return si_unit_of(text) or si_unit_of(text.lower()) or (text, 1.0)


def full_scale_of(dtype: np.dtype[Any], scale: float, offset: float) -> tuple[float, float]:
    """Return the smallest and the largest physical value that an integer type can represent."""
    codes = np.iinfo(dtype)
    ends = (codes.min * scale + offset, codes.max * scale + offset)
    return min(ends), max(ends)


def _in_seconds(channels: list[Channel]) -> list[Channel]:
    """Return the channels with date-times converted to seconds since the earliest one."""
    found = {
        id(array): array
        for channel in channels
        for array in (channel.time, channel.values)
        if array is not None and array.dtype.kind == "M"
    }
    if not found:
        return channels
    first = min(array[0] for array in found.values())
    seconds = {key: (array - first) / np.timedelta64(1, "s") for key, array in found.items()}
    return [
        replace(
            channel,
            time=seconds.get(id(channel.time), channel.time),
            values=seconds.get(id(channel.values), channel.values),
        )
        for channel in channels
    ]


def _variable(channel: Channel, dimension: str) -> xr.DataArray:
    units, factor = si_unit(channel.unit)
    # combined into one scaling, so that a packed record can be written back exactly
    scale, offset = channel.scale * factor, channel.offset * factor
    values = np.asarray(channel.values)
    packed = values.dtype.kind in "iu" and channel.scale != 1.0
    with np.errstate(invalid="ignore", over="ignore"):  # damaged files contain signalling NaN and numbers that overflow
        physical = values.astype(np.float64)
        size = np.abs(physical)
        if (beyond := (size > _OVERLOAD[0]) & (size < _OVERLOAD[1])).any():
            physical[beyond] = np.inf * np.sign(physical[beyond])
        if scale != 1.0:
            physical *= scale
        if offset != 0.0:
            physical += offset
    array = xr.DataArray(physical, dims=(dimension,))
    array.attrs = {"units": units, "source_units": channel.unit, "long_name": channel.long_name}
    if channel.group:
        array.attrs["group"] = channel.group
    if channel.stored:
        array.attrs["stored"] = channel.stored
    if channel.full_scale is not None:
        array.attrs["full_scale"] = [float(limit) * factor for limit in channel.full_scale]
    elif packed:
        array.attrs["full_scale"] = list(full_scale_of(values.dtype, scale, offset))
    if packed:
        array.encoding = {"dtype": values.dtype, "scale_factor": scale, "add_offset": offset}
    return array


def _variable_name(name: str) -> str:
    return f"{name}_channel" if re.fullmatch(r"time(_\d+)?", name) else name


def _unique(channels: Iterable[Channel], path: Path) -> None:
    seen: dict[str, str] = {}
    for channel in channels:
        name = _variable_name(channel.name)
        if name in seen and seen[name] != channel.name:
            both = f"channels '{seen[name]}' and '{channel.name}'"
            raise InputError(f"{path}: {both} would both be called '{name}'; rename one")
        if name in seen:
            raise InputError(f"{path}: channel '{channel.name}' occurs twice; give the channels different names")
        seen[name] = channel.name


class _TimeBases:
    """The time bases of a record; channels sampled simultaneously share one."""

    def __init__(self, channels: Iterable[Channel], path: Path) -> None:
        self._times: list[np.ndarray] = []
        self._counted: set[int] = set()
        self._dimensions: dict[str, int] = {}
        known: dict[Hashable, int] = {}
        for channel in channels:
            stated = (channel.start, channel.interval, len(channel.values))
            key = stated if channel.time is None else id(channel.time)
            if channel.time is not None:
                _check_length(channel, channel.time, path)
            if key not in known:
                counted = _counted(channel)
                known[key] = self._add(_times(channel, path) if counted is None else counted)
                if counted is not None:
                    self._counted.add(known[key])
            self._dimensions[channel.name] = known[key]
        self._first = min(time[0] for time in self._times)

    def _add(self, time: np.ndarray) -> int:
        for index, known in enumerate(self._times):
            if known.size == time.size and np.array_equal(known, time):
                return index
        self._times.append(time)
        return len(self._times) - 1

    @staticmethod
    def _name(index: int) -> str:
        return "time" if index == 0 else f"time_{index + 1}"

    def dimension_of(self, channel: Channel) -> str:
        return self._name(self._dimensions[channel.name])

    def coordinates(self) -> dict[str, xr.DataArray]:
        return {
            self._name(i): xr.DataArray(
                time - self._first,
                dims=(self._name(i),),
                attrs=_clock(time) | ({"counted": _COUNTED} if i in self._counted else {}),
            )
            for i, time in enumerate(self._times)
        }


def _clock(time: np.ndarray) -> dict[str, Any]:
    """Return the attributes of a time base: ``jitter`` is the standard deviation of its intervals without gaps, s."""
    attributes: dict[str, Any] = {"units": "s", "long_name": "time"}
    if time.size > 2:
        intervals = np.diff(time)
        typical = float(np.median(intervals))
        usual = intervals[intervals <= LONG * typical] / typical
        jitter = float(np.std(usual)) * typical if usual.size else 0.0
        resolution = np.spacing(np.abs(time[[0, -1]]).max())
        if jitter > max(_ROUNDING * typical, 4 * resolution):
            attributes["jitter"] = jitter
    return attributes


def _check_length(channel: Channel, time: np.ndarray, path: Path) -> None:
    if time.size != len(channel.values):
        raise InputError(
            f"{path}: channel '{channel.name}' has {len(channel.values)} samples but {time.size} times;"
            " the file is damaged or cut off: export it again"
        )


def _counted(channel: Channel) -> np.ndarray | None:
    """Return sampling times computed from the first time stamp and the stated rate if time stamps repeat; else None.

    Stamps in ms cannot resolve samples at 20 kHz; the stated rate can, provided that both agree on the record's duration.
    """
    if channel.time is None or channel.interval is None or len(channel.time) < 2:
        return None
    time = np.asarray(channel.time, dtype=np.float64)
    steps = np.diff(time)
    if not np.isfinite(steps).all() or steps.min() != 0 or steps.max() == 0:
        return None
    seconds, coarse = channel.interval * len(steps), float(steps[steps > 0].min())
    if abs(time[-1] - time[0] - seconds) > 2 * coarse + _DRIFT * seconds:
        return None
    return np.asarray(time[0] + channel.interval * np.arange(len(time)))


def _times(channel: Channel, path: Path) -> np.ndarray:
    """Return the times of a channel's samples, s: as given, or equally spaced from its start."""
    if channel.time is not None:
        return _checked(channel, path)
    name, start, interval, n = channel.name, channel.start, channel.interval, len(channel.values)
    if interval is None or not np.isfinite(interval) or interval <= 0:
        raise InputError(
            f"{path}: channel '{name}' has no time base (interval {interval} s); give the file a time channel in s or a"
            " sampling rate in Hz"
        )
    if n == 0:
        raise InputError(f"{path}: channel '{name}' has no samples")
    if not np.isfinite(start):
        raise InputError(f"{path}: channel '{name}' starts at {start} s; its time is damaged")
    if interval < 4 * np.spacing(abs(start) + interval * n):
        raise InputError(
            f"{path}: channel '{name}' starts at {start:g} s, which is too large to resolve samples every {interval:g} s;"
            " correct its start time"
        )
    return start + interval * np.arange(n)


def _checked(channel: Channel, path: Path) -> np.ndarray:
    time = np.asarray(channel.time, dtype=np.float64)
    if time.size == 0:
        raise InputError(f"{path}: channel '{channel.name}' has no samples")
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise InputError(
            f"{path}: the time of sample {bad[0] + 1} is not a number; correct the time of channel '{channel.name}'"
        )
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0)
    if back.size:
        at = int(back[0])
        raise InputError(
            f"{path}: time does not increase after sample {at + 1} ({time[at]:.9g} s, then {time[at + 1]:.9g} s);"
            f" {_why_not_on(channel, time, steps, at)} (channel '{channel.name}')"
        )
    if steps.size and (apart := float(np.median(steps))) < _SHORTEST:
        raise InputError(
            f"{path}: the times of channel '{channel.name}' give a sample every {apart:.3g} s, so they are not in s; state their"
            " unit, as in 'Time [ms]', or 'Time [d]' for days as in spreadsheets"
        )
    return time


def _why_not_on(channel: Channel, time: np.ndarray, steps: np.ndarray, at: int) -> str:
    """Return why the times do not increase after a sample, with the remedy."""
    repeated = int(np.sum(steps == 0))
    if steps[at] == 0 and repeated <= _FEW * time.size and steps.min() == 0:
        return f"{counted(repeated, 'sample')} of {time.size} may be duplicated: delete the copies, or export it again"
    if steps[at] == 0:
        other = _other_length(channel, time)
        return f"it repeats: the times may have been written with too few digits{other}; export it again{_OR_RATE}"
    if time[at + 1] <= time[0]:
        return "it restarts: the file may contain several records; give one alone"
    return "it goes back: samples may be duplicated, or parts joined in the wrong order; export it again"


def _other_length(channel: Channel, time: np.ndarray) -> str:
    """Return how a stated rate contradicts repeating time stamps; "" without a stated rate."""
    if channel.interval is None:
        return ""
    return (
        f" (they span {time[-1] - time[0]:.4g} s, but {len(time)} samples at the stated {1 / channel.interval:.6g} Hz span"
        f" {channel.interval * (len(time) - 1):.4g} s)"
    )
