"""Conversion of a tree of arrays, as read from HDF5, MAT, CSV and Parquet files, to channels on their time bases.

In such files only names and attributes distinguish times, rates and channels; they are interpreted here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from tdbsim.errors import InputError
from tdbsim.units import si_unit_of

from tdbmon.record.channel import Channel, named_apart
from tdbmon.record.date import first_dated
from tdbmon.record.timebase import (
    interval_of,
    is_time_name,
    moments,
    names_and_units,
    split_unit,
    start_of,
    time_factor,
)

_UNIT_KEYS = ("units", "unit", "unit_string", "engineering_unit", "engineeringunit", "eu", "ylabelunit", "einheit")
_NAME_KEYS = ("name", "channel_name", "channelname", "label")
_NAMES_KEYS = ("channel_names", "channelnames", "names", "labels", "channels", "columns", "signal_names", "varnames")
_TITLE_KEYS = ("title", "name", "test", "versuch", "description")
_DATE_KEYS = ("drop_time", "date", "datum", "datetime", "date_time", "start_time", "start time", "time_coverage_start",
              "recording_date", "test_date", "timestamp", "drop_time_unread")  # fmt: skip
_PLAIN_VALUES = {"data", "values", "value", "y", "signal", "samples", "raw", "ydata", "amplitude"}


@dataclass(frozen=True)
class Leaf:
    """An array of numbers or date-times (1-D, or 2-D with channels along the shorter axis) with its attributes."""

    name: str
    values: np.ndarray
    attributes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Branch:
    """A node of the tree: its arrays, entries (scalars and texts that describe them), and subnodes."""

    name: str
    leaves: tuple[Leaf, ...]
    entries: Mapping[str, Any] = field(default_factory=dict)
    branches: tuple[Branch, ...] = ()


def channels_of(root: Branch, path: Path) -> tuple[Channel, ...]:
    """Return the channels of a tree; channels without a time base are returned with their fault.

    Raises
    ------
    InputError
        If there are arrays, but none of them has a time base.
    """
    channels = list(_channels(root, "", {}, []))
    found, timeless = ([each for each in channels if bool(each.fault) is lacks] for lacks in (False, True))
    if not found and timeless:
        shown = ", ".join(f"'{channel.name}'" for channel in timeless[:10])
        raise InputError(
            f"{path}: the sampling times of {shown} are not given; name the time 'time', or give it its unit ('[s]'),"
            " or add an entry 'dt' in s or 'fs' in Hz"
        )
    return named_apart(found + timeless)


def text_of(entry: Any) -> str:
    """Return an entry as text, with bytes decoded and one-element arrays unpacked; "" if it is not a text."""
    if isinstance(entry, np.ndarray):
        if entry.size != 1:
            return ""
        entry = entry.reshape(-1)[0]
    if isinstance(entry, bytes):
        return entry.decode("utf-8", "replace").strip("\0 ")
    return str(entry).strip() if isinstance(entry, str) else ""


def first_text(entries: Mapping[str, Any], keys: tuple[str, ...]) -> str | None:
    """Return the first nonempty text among the entries with the given keys (in lower case); None if there is none."""
    lowered = {str(key).lower(): value for key, value in entries.items()}
    for key in keys:
        if key in lowered and (text := text_of(lowered[key])):
            return text
    return None


def stated_title(entries: Mapping[str, Any]) -> str:
    """Return the title of the record as stated in the file; "" if none is stated."""
    return first_text(entries, _TITLE_KEYS) or ""


def stated_date(entries: Mapping[str, Any]) -> str:
    """Return the date, with or without a time, as written in the file; "" if none is stated.

    A date that cannot be interpreted is returned only if there is no other, so that it can be reported.
    """
    return first_dated(first_text(entries, (key,)) or "" for key in _DATE_KEYS)


def _channels(branch: Branch, place: str, inherited: Mapping[str, Any], times: list[np.ndarray]) -> Iterator[Channel]:
    """Yield the channels of a node and its subnodes, given the path, entries and times inherited from its parents."""
    entries = {**inherited, **branch.entries}
    leaves = [column for leaf in branch.leaves for column in _columns(leaf, branch.entries)]
    clocks = [(i, _time(leaf)) for i, leaf in enumerate(leaves)]
    own = {i: time for i, time in clocks if time is not None}
    if not own and not times and all(interval_of(each) is None for each in (entries, *(x.attributes for x in leaves))):
        own = _by_its_unit(leaves)
    data = [(i, leaf) for i, leaf in enumerate(leaves) if i not in own]
    longest = max((leaf.values.size for _, leaf in data), default=0)
    split = names_and_units([leaf.name for leaf in leaves])
    for i, leaf in data:
        name, stored, unit = _label(leaf, split[i], branch, place, alone=len(data) == 1)
        channel = Channel(
            name,
            leaf.values,
            unit,
            scale=_number(leaf, "scale_factor", 1.0),
            offset=_number(leaf, "add_offset", 0.0),
            long_name=first_text(leaf.attributes, ("long_name", "description")) or "",
            group=place,
            stored=stored,
        )
        time = _time_for(i, leaf, own, times)
        interval = interval_of(leaf.attributes)
        if interval is None and leaf.values.size == longest:
            interval = interval_of(entries)
        if time is not None:
            yield replace(_without_padding(channel, time), interval=interval)
        elif interval is not None:
            own_start = start_of(leaf.attributes)  # a stated 0 must not be overridden
            start = start_of(entries) if own_start is None else own_start
            yield replace(channel, interval=interval, start=start or 0.0)
        else:
            fault = _fault(leaf.values.size, [*times, *own.values()], longest if interval_of(entries) else 0)
            yield replace(channel, fault=fault)
    for inner in branch.branches:
        below = f"{place}/{inner.name}" if place else inner.name
        yield from _channels(inner, below, entries, [*times, *own.values()])


def _fault(size: int, times: list[np.ndarray], longest: int) -> str:
    """Return why an array has no time base; `longest` is the size of the arrays to which a rate applies, 0 without a rate."""
    if times:
        nearest = min((time.size for time in times), key=lambda each: abs(each - size))
        return (
            f"it has {size} samples, but the time vector beside it has {nearest}, so the two cannot be matched:"
            " export it again with one value per time"
        )
    if longest:
        return (
            f"it has {size} samples, but others have {longest}, so its sampling times are unknown: export it again, or"
            " give it a 'dt' or 'fs' of its own"
        )
    return "its sampling times are not given"


def _columns(leaf: Leaf, entries: Mapping[str, Any]) -> list[Leaf]:
    """Return an array split into its columns, one leaf each; [] if it is not a real-valued or date-time series."""
    values = leaf.values
    if values.dtype.kind == "b":
        values = values.astype(np.int8)
    if values.dtype.kind not in "iufM" or values.ndim not in (1, 2) or values.size == 0:
        return []
    if values.ndim == 1 or 1 in values.shape:
        return [replace(leaf, values=values.reshape(-1))]
    if values.shape[0] < values.shape[1]:
        values = values.T
    width = values.shape[1]
    names = _texts({**entries, **leaf.attributes}, _NAMES_KEYS, width) or [f"{leaf.name}_{k + 1}" for k in range(width)]
    units = _texts({**entries, **leaf.attributes}, _UNIT_KEYS, width)
    plain = {key: value for key, value in leaf.attributes.items() if key.lower() not in _UNIT_KEYS or units is None}
    return [
        Leaf(names[k], np.ascontiguousarray(values[:, k]), {**plain, **({"units": units[k]} if units else {})})
        for k in range(width)
    ]


def _number(leaf: Leaf, attribute: str, without: float) -> float:
    """Return a CF packing attribute (``scale_factor``, ``add_offset``), which loggers also use outside netCDF."""
    stated = np.asarray(leaf.attributes.get(attribute, without))
    return float(stated.reshape(-1)[0]) if stated.size == 1 and stated.dtype.kind in "iuf" else without


def _texts(entries: Mapping[str, Any], keys: tuple[str, ...], count: int) -> list[str] | None:
    for key, entry in entries.items():
        if str(key).lower() in keys and isinstance(entry, (list, tuple, np.ndarray)) and len(entry) == count:
            texts = [text_of(item) for item in entry]
            if any(texts):
                return texts
    return None


def _time(leaf: Leaf) -> np.ndarray | None:
    if not is_time_name(leaf.name):
        return None
    unit = _unit(leaf)
    factor = time_factor(unit)
    return None if factor is None else _times(leaf.values, unit, factor)


def _unit(leaf: Leaf) -> str:
    unit = first_text(leaf.attributes, _UNIT_KEYS)
    return unit if unit is not None else split_unit(leaf.name)[1] or ""


def _times(values: np.ndarray, unit: str, factor: float) -> np.ndarray:
    """Return times in s, or as datetime64 if they are tick counts or date-times."""
    if values.dtype.kind == "M":
        return values
    counted = moments(values, unit)
    return counted if counted is not None else np.asarray(values, dtype=np.float64) * factor


def _by_its_unit(leaves: list[Leaf]) -> dict[int, np.ndarray]:
    """Return the index and times of the first strictly increasing array with a unit of time, whatever its name.

    If there is none, the first non-decreasing one, such as a clock with too few digits, whose fault is reported later.
    """
    repeats: dict[int, np.ndarray] = {}
    for i, leaf in enumerate(leaves):
        unit = _unit(leaf)
        si = si_unit_of(unit)
        if si is None or si[0] != "s" or leaf.values.size < 2:
            continue
        steps = np.diff(leaf.values)
        if np.all(steps > 0):
            return {i: _times(leaf.values, unit, si[1])}
        if np.all(steps >= 0) and not repeats:
            repeats = {i: _times(leaf.values, unit, si[1])}
    return repeats


def _time_for(index: int, leaf: Leaf, own: Mapping[int, np.ndarray], inherited: list[np.ndarray]) -> np.ndarray | None:
    """Return the time array of matching length: the last one before the array, else the first after it, else an inherited one."""
    fitting = {i: time for i, time in own.items() if time.size == leaf.values.size}
    if fitting:
        before = [i for i in fitting if i < index]
        return fitting[max(before) if before else min(fitting)]
    return next((time for time in reversed(inherited) if time.size == leaf.values.size), None)


def _label(
    leaf: Leaf, split: tuple[str, str | None], branch: Branch, place: str, alone: bool
) -> tuple[str, str, str]:
    """Return a channel's name, the path under which it is stored ("" if it has the same name), and its unit.

    `split` is the leaf's name without the unit at its end, and that unit.
    """
    bare, at_end = split
    unit = first_text(leaf.attributes, _UNIT_KEYS)
    name = first_text(leaf.attributes, _NAME_KEYS)
    is_folder = alone and bare.lower() in _PLAIN_VALUES and branch.name != ""
    if is_folder:
        name = name or first_text(branch.entries, _NAME_KEYS) or branch.name
        unit = unit if unit is not None else first_text(branch.entries, _UNIT_KEYS)
    if at_end is None or (unit is not None and si_unit_of(unit) != si_unit_of(at_end)):
        bare = leaf.name  # it does not end with its unit
    own, path = (branch.name, place) if is_folder else (bare, f"{place}/{bare}" if place else bare)
    return name or own, path if name not in (None, own) else "", unit if unit is not None else (at_end or "")


def _without_padding(channel: Channel, time: np.ndarray) -> Channel:
    """Return a channel with its time, without trailing rows that have no time, i.e. padding of columns of unequal length."""
    known = np.flatnonzero(np.isfinite(time))
    end = int(known[-1]) + 1 if known.size else 0
    if end == time.size or np.isfinite(channel.values[end:]).any():
        return replace(channel, time=time)
    return replace(channel, values=channel.values[:end], time=time[:end])
