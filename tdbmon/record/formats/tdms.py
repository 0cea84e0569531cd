"""TDMS, the file format of National Instruments data acquisition."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tdbmon.record.channel import Channel, Content, named_apart
from tdbmon.record.format import library
from tdbmon.record.formats.stored_size import check_size
from tdbmon.record.timebase import is_time_name, time_factor
from tdbmon.record.tree import Branch, Leaf, channels_of, stated_date, stated_title

_FIRST_DATE = np.datetime64("1980-01-01")  # LabVIEW writes 1904-01-01 if the start is unknown


class TDMS:
    """TDMS files: channels with waveform properties (``wf_increment``), or with a time channel in their group."""

    name = "TDMS"
    extra: str | None = "tdms"

    def recognises(self, head: bytes, path: Path) -> bool:
        return head.startswith(b"TDSm")

    def read(self, path: Path) -> Content:
        nptdms = library("nptdms", self, path)
        nptdms.log.log_manager.set_level(logging.CRITICAL)
        # opened here, since the library does not close a file that it cannot read
        with path.open("rb") as raw, nptdms.TdmsFile.open(raw) as file:
            samples = sum(len(channel) for group in file.groups() for channel in group.channels())
            check_size(samples, path, compressed=False)  # at least one byte each
            empty = [channel for group in file.groups() for channel in group.channels() if len(channel) == 0]
            cut = file.file_status.incomplete_final_segment
            groups = [(group.name, dict(group.properties), _series(group)) for group in file.groups()]
            entries = dict(file.properties)
        starts = [entry.began for _, _, series in groups for entry in series if entry.began is not None]
        dated = [began for began in starts if began >= _FIRST_DATE]
        first = min(dated or starts, default=None)
        channels = _waveforms(groups, first)
        others = tuple(Branch(name, _leaves(series, first), properties) for name, properties, series in groups)
        if not channels:
            channels = channels_of(Branch("", (), entries, others), path)
        else:  # in a file with waveforms, a group without a time channel is a table of results
            timed = tuple(branch for branch in others if _is_timed(branch))
            channels += channels_of(Branch("", (), entries, timed), path)
            fault = "it has no sampling interval (wf_increment), and its group has no time channel"
            untimed = (leaf for branch in others if not _is_timed(branch) for leaf in branch.leaves)
            channels += tuple(Channel(leaf.name, np.empty(0), fault=fault) for leaf in untimed)
        channels += tuple(Channel(channel.name, np.empty(0), fault="it has no samples") for channel in empty)
        return Content(
            channels,
            title=stated_title(entries),
            drop_time=f"{np.datetime_as_string(min(dated), unit='ms')}Z" if dated else stated_date(entries),
            incomplete="the logger was interrupted while it wrote the last segment" if cut else "",
        )


def _is_timed(branch: Branch) -> bool:
    return any(is_time_name(leaf.name) for leaf in branch.leaves)


@dataclass(frozen=True)
class _Series:
    name: str
    values: np.ndarray
    unit: str
    interval: float  # 0 if the channel is not a waveform
    offset: float
    began: np.datetime64 | None
    description: str
    moments: bool  # True if `values` are seconds since `began`
    fault: str  # reason if the waveform is not along time, such as a spectrum


def _series(group: Any) -> list[_Series]:
    found = []
    for channel in group.channels():
        values, properties = np.asarray(channel[:]), channel.properties
        unit, began = str(properties.get("unit_string", "")), properties.get("wf_start_time")
        if values.size == 0:
            continue
        axis = str(properties.get("wf_xunit_string") or "s")
        factor = time_factor(axis) if properties.get("wf_increment") else 1.0
        moments = values.dtype.kind == "M"
        if moments:  # a channel of date-times is a time
            began, values, unit = values[0], (values - values[0]) / np.timedelta64(1, "s"), "s"
        elif values.dtype.kind == "b":
            values = values.astype(np.int8)
        elif values.dtype.kind not in "iuf":
            continue
        found.append(
            _Series(
                channel.name,
                values,
                unit,
                float(properties.get("wf_increment") or 0.0) * (factor or 1.0),
                float(properties.get("wf_start_offset") or 0.0) * (factor or 1.0),
                began if isinstance(began, np.datetime64) else None,
                str(properties.get("description") or ""),
                moments,
                "" if factor is not None else f"its axis is in {axis}, not time",
            )
        )
    return found


def _waveforms(
    groups: list[tuple[str, dict[str, Any], list[_Series]]], first: np.datetime64 | None
) -> tuple[Channel, ...]:
    return named_apart(
        [
            Channel(
                entry.name,
                entry.values,
                entry.unit,
                start=_late(entry, first) + entry.offset,
                interval=entry.interval,
                long_name=entry.description,
                group=group,
                fault=entry.fault,
            )
            for group, _, series in groups
            for entry in series
            if entry.interval > 0
        ]
    )


def _late(entry: _Series, first: np.datetime64 | None) -> float:
    """Return the delay of a channel's start after the earliest start in the file, s; 0 if it is not stated."""
    if entry.began is None or first is None or entry.began < first:
        return 0.0
    return float((entry.began - first) / np.timedelta64(1, "s"))


def _leaves(series: list[_Series], first: np.datetime64 | None) -> tuple[Leaf, ...]:
    return tuple(
        Leaf(
            entry.name,
            entry.values + _late(entry, first) if entry.moments else entry.values,
            {"unit": entry.unit} if entry.unit else {},
        )
        for entry in series
        if entry.interval <= 0
    )
