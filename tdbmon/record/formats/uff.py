"""UFF (universal file format), data set 58: functions at nodal degrees of freedom; only time responses are read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from tdbsim.errors import InputError

from tdbmon.record.channel import Channel, Content
from tdbmon.record.format import library
from tdbmon.record.timebase import time_factor

_DAY = re.compile(r"^(\d{1,2}-[A-Za-z]{3}-)(\d{2})(?!\d)")
_TIME_RESPONSE, _TIME_AXIS, _EVEN = 1, 17, 1


class UFF58:
    """UFF files: data sets 58 along a time axis are channels; spectra and geometry are left out."""

    name = "UFF58"
    extra: str | None = "uff"

    def recognises(self, head: bytes, path: Path) -> bool:
        return re.match(rb"\s{0,8}-1[ \t]*\r?\n[ \t]*\d{1,5}b?[ \t\r\n]", head) is not None

    def read(self, path: Path) -> Content:
        pyuff = library("pyuff", self, path)
        file = pyuff.UFF(str(path))
        kinds = np.atleast_1d(file.get_set_types())
        sets = [file.read_sets(int(index)) for index in np.flatnonzero(kinds == 58)]
        responses = [entry for entry in sets if _is_response(entry)]
        if not responses:
            raise InputError(f"{path}: is a UFF file without a time response in a data set 58; export time histories")
        names = _names(responses)
        channels = tuple(_channel(entry, name, path) for entry, name in zip(responses, names, strict=True))
        first = responses[0]
        return Content(channels, _text(first, "id2"), _dated(_text(first, "id3")), _cut_off(path))


def _dated(text: str) -> str:
    """Return the date of a data set with a four-digit year: the format has DD-MMM-YY, which could be read as YY-MMM-DD."""
    return _DAY.sub(lambda found: f"{found[1]}{'19' if found[2] >= '70' else '20'}{found[2]}", text)


def _cut_off(path: Path) -> str:
    """Return a warning if the last data set lacks its end mark, as the library silently drops such a set; else ""."""
    marks = re.findall(rb"(?m)^ {4}-1[ \t]*\r?$", path.read_bytes())
    return "the last data set was cut off and is left out" if len(marks) % 2 else ""


def _text(entry: Mapping[str, Any], key: str) -> str:
    text = str(entry.get(key) or "").strip()
    return "" if text.upper() == "NONE" else text


def _is_response(entry: Mapping[str, Any]) -> bool:
    if np.iscomplexobj(entry["data"]):
        return False
    return entry.get("func_type") == _TIME_RESPONSE or entry.get("abscissa_spec_data_type") == _TIME_AXIS


def _names(entries: list[dict[str, Any]]) -> list[str]:
    """Return the channel names from the first of the fields used by vendors in which all channels differ."""
    for key in ("rsp_ent_name", "id1", "id4", "id5", "id2"):
        texts = [_text(entry, key) for entry in entries]
        if all(texts) and len(set(texts)) == len(texts):
            return texts
    points = [f"{entry.get('rsp_node', 0)}:{entry.get('rsp_dir', 0)}" for entry in entries]
    return points if len(set(points)) == len(points) else [f"ch{k + 1}" for k in range(len(entries))]


def _channel(entry: Mapping[str, Any], name: str, path: Path) -> Channel:
    values = np.asarray(entry["data"], dtype=np.float64)
    expected = int(entry["num_pts"])
    if values.size != expected:
        raise InputError(
            f"{path}: channel '{name}' has {values.size} samples, but its header states {expected};"
            " the file was cut off: export it again"
        )
    unit = _text(entry, "ordinate_axis_units_lab")
    factor = time_factor(_text(entry, "abscissa_axis_units_lab")) or 1.0
    if entry.get("abscissa_spacing") == _EVEN:
        start, interval = float(entry["abscissa_min"]) * factor, float(entry["abscissa_inc"]) * factor
        return Channel(name, values, unit, start=start, interval=interval, long_name=_text(entry, "id1"))
    return Channel(
        name, values, unit, time=np.asarray(entry["x"], dtype=np.float64) * factor, long_name=_text(entry, "id1")
    )
