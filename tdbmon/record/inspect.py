"""Summary of the contents of a file, without a machine file."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from tdbmon.record.date import unread_date
from tdbmon.record.read import read
from tdbmon.record.samples import times_of
from tdbmon.record.timebase import LONG, usual_interval

_HEADINGS = (
    "channel", "kind", "unit in file", "rate", "samples", "start", "duration", "gaps", "min", "mean", "max", "NaN",
)  # fmt: skip
_MOST = 10  # largest number of channels left out, and of variables that are not channels, listed in the terminal


@dataclass(frozen=True)
class ChannelInfo:
    """Summary of one channel; `minimum`, `mean` and `maximum` are in `unit`, or None if no sample is finite."""

    name: str
    stored: str  # name under which the file stores it, if `name` is a label
    kind: str  # displacement, speed, keyphasor, voltage or other: guessed from unit, name and values
    unit: str
    source_unit: str
    rate_hz: float | None
    samples: int
    start_s: float
    duration_s: float
    gaps: int
    minimum: float | None
    mean: float | None
    maximum: float | None
    nan: int


@dataclass(frozen=True)
class Inspection:
    """Summary of a file: its provenance, date, channels, and what was left out."""

    file: str
    reader: str
    sha256: str
    size: int
    title: str
    drop_time: str
    drop_time_from: str  # meaning of that time, if it may differ from the drop's
    drop_time_unread: str  # the date as stated in the file, if it could not be interpreted
    machine: str
    incomplete: str
    left_out: dict[str, str]  # channels that cannot be used, with the reason
    beside: dict[str, str]  # variables that are not channels, with their dimensions
    channels: tuple[ChannelInfo, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain dictionaries, lists, numbers and texts for ``json.dumps``."""
        out = asdict(self)
        out["channels"] = list(out["channels"])
        return out

    def lines(self) -> list[str]:
        """Return a table for the terminal, displacements in um."""
        head = [f"{self.file}   {self.reader}, {self.size / 1e6:.3g} MB, SHA-256 {self.sha256[:16]}..."]
        doubt = f" ({self.drop_time_from}: check)" if self.drop_time_from else ""
        words = (("title", self.title), ("machine", self.machine), ("drop", f"{self.drop_time}{doubt}"))
        head += [f"{word}: {text}" for word, text in words if text]
        head += [unread_date(self.drop_time_unread)] if self.drop_time_unread else []
        head += [f"incomplete: {self.incomplete}"] if self.incomplete else []
        head += [f"left out: {name}: {why}" for name, why in list(self.left_out.items())[:_MOST]]
        head += [f"left out: {len(self.left_out) - _MOST} more"] if len(self.left_out) > _MOST else []
        if self.beside:
            named = [f"{name} ({along})" for name, along in list(self.beside.items())[:_MOST]]
            more = f" and {len(self.beside) - _MOST} more" if len(self.beside) > _MOST else ""
            head.append(f"not channels over time, so not analysed: {', '.join(named)}{more}")
        rows = [_HEADINGS, *(_row(info) for info in self.channels)]
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        table = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        return [*head, "", *table]


def inspect(path: str | Path) -> Inspection:
    """Read a file and return a summary of its contents.

    Raises
    ------
    InputError
        As `tdbmon.record.read.read`.
    """
    path = Path(path)
    record = read(path)
    attributes = record.attrs
    return Inspection(
        file=attributes["source_file"],
        reader=attributes["reader"],
        sha256=attributes["sha256"],
        size=path.stat().st_size,
        title=attributes["title"],
        drop_time=attributes["drop_time"],
        drop_time_from=attributes.get("drop_time_from", ""),
        drop_time_unread=attributes.get("drop_time_unread", ""),
        machine=attributes.get("machine", ""),
        incomplete=attributes.get("incomplete", ""),
        left_out=dict(attributes.get("left_out", {})),
        beside=dict(attributes.get("beside", {})),
        channels=tuple(_channel(str(name), record) for name in record.data_vars),
    )


def _row(info: ChannelInfo) -> tuple[str, ...]:
    factor, unit = (1e6, "um") if info.unit == "m" else (1.0, "" if info.unit == "1" else info.unit)
    rate = "-" if info.rate_hz is None else f"{info.rate_hz:.6g} Hz"
    values = ("-" if x is None else f"{x * factor:.5g} {unit}".strip() for x in (info.minimum, info.mean, info.maximum))
    when = (rate, str(info.samples), f"{info.start_s:.4g} s", f"{info.duration_s:.4g} s", str(info.gaps))
    name = f"{info.name} ({info.stored})" if info.stored else info.name
    return (name, info.kind, info.source_unit or "-", *when, *values, str(info.nan))


def _channel(name: str, record: xr.Dataset) -> ChannelInfo:
    array = record[name]
    values, time = array.values, times_of(array)
    finite = values[np.isfinite(values)]
    intervals = np.diff(time)
    typical = float(np.median(intervals)) if intervals.size else None
    has = finite.size > 0
    return ChannelInfo(
        name=name,
        stored=str(array.attrs.get("stored", "")),
        kind=_kind(name, str(array.attrs.get("units", "")), finite),
        unit=str(array.attrs.get("units", "")),
        source_unit=str(array.attrs.get("source_units", "")),
        rate_hz=None if typical is None else 1 / usual_interval(time),
        samples=int(values.size),
        start_s=float(time[0]),
        duration_s=float(time[-1] - time[0]),
        gaps=0 if typical is None else int(np.sum(intervals > LONG * typical)),
        minimum=float(finite.min()) if has else None,
        mean=float(finite.mean()) if has else None,
        maximum=float(finite.max()) if has else None,
        nan=int(values.size - finite.size),
    )


def _kind(name: str, unit: str, finite: np.ndarray) -> str:
    word = name.lower()
    if re.search(r"key|kph|phasor|tacho|pulse|trigger", word) and unit in ("", "1", "V"):
        return "keyphasor"
    if unit == "m":
        return "displacement"
    if unit == "Hz" or (unit in ("", "1") and re.search(r"speed|rpm|drehzahl|rev", word)):
        return "speed"
    if (
        unit in ("", "1")
        and 1 < finite.size
        and np.isin(finite, (finite.min(), finite.max())).all()
        and np.ptp(finite) > 0
    ):
        return "keyphasor"
    return "voltage" if unit == "V" else "other"
