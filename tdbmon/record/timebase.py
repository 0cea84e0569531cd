"""Interpretation of the time information in files: a time channel, sampling interval or sampling rate, under many names."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np
from tdbsim.errors import InputError
from tdbsim.units import is_bare, is_unit, scale, si_unit_of, to_si

_TIME_NAMES = {"time", "t", "zeit", "temps", "tiempo", "tempo", "timestamp", "timestamps", "times", "zeitstempel",
               "abszeit", "elapsed", "elapsedtime", "relativetime", "timestep", "timevector", "timevec", "tvec",
               "timeaxis", "timechannel", "aika"}  # fmt: skip
_INTERVAL_NAMES = {"dt", "deltat", "deltatime", "ts", "sampleinterval", "samplinginterval", "sampletime", "increment",
                   "xincrement", "timeincrement", "wfincrement", "interval", "samplingperiod", "sampleperiod",
                   "samplingtime", "timestep", "abtastintervall"}  # fmt: skip
_RATE_NAMES = {"fs", "samplingrate", "samplerate", "samplingfrequency", "samplefrequency", "fsamp", "fsample", "sr",
               "rate", "samplingfreq", "samplespersecond", "samplingratehz", "samplerateinhz", "fshz", "abtastrate",
               "samplingrateinhz", "frequencysampling", "sampless", "samplessec", "samplespersec", "sps", "scanrate",
               "abtastfrequenz", "messrate"}  # fmt: skip
_START_NAMES = {"t0", "tstart", "starttime", "timestart", "wfstartoffset", "xstart", "offsettime"}

_NO_UNIT = ("", "1", "-")
_SECONDS = 10**9, 0  # ns per tick, and tick count at 1970-01-01
_TICKS = ((1, 0), (10**3, 0), (10**6, 0), (100, 116444736 * 10**9), _SECONDS)  # the fourth is the Windows file time
_RECORDED = [int(np.datetime64(day, "ns").astype(np.int64)) for day in ("1980-01-01", "2100-01-01")]

LONG = 1.5  # times the typical interval: above, the time axis has a gap

_PER_SECOND = re.compile(r"(?i)(k|M)?(?:S|Sa|samples?)/s(?:ec)?$")  # a unit of sampling rates
_THOUSANDS = re.compile(r"[1-9]\d{0,2}(?:[.,]\d{3})+(?=$|\s*Hz$)")
_DECIMAL_COMMA = re.compile(r"^(\s*\d+),(?=\d)")  # a comma that remains after the removal of thousands separators is decimal
_DEWESOFT = re.compile(r"Data\d+_time_")  # in DEWESoft MATLAB files: Data1_time_NDE_A is the time of Data1_NDE_A
_BRACKET = re.compile(r"^(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))\s*$", re.DOTALL)
# units that end a name; not A, V, g or m, with which names of probes end, nor "Lowpass_50_Hz"
_SUFFIX = re.compile(
    r"(?i)^(.+?)[_ ](?:(um|µm|μm|microns?|mm|mils?)|(?<!\d.)(ms|us|µs|μs|msec|usec|sec|hz|rpm|(?-i:mV|kHz)))$", re.DOTALL
)
_SECONDS_SUFFIX = re.compile(r"^(.+)[_ ](s)$")  # of a time or an interval alone


def before_holes(time: np.ndarray) -> np.ndarray:
    """Return the last time before each gap in times of shape (n,), n > 1, s."""
    steps = np.diff(time)
    return np.asarray(time[:-1][steps > LONG * np.median(steps)])


def usual_interval(time: np.ndarray) -> float:
    """Return the mean interval without gaps of times of shape (n,), n > 1, s; averaging removes the rounding of time stamps."""
    count, seconds = _without_gaps(time)
    return seconds / count


def usual_rate(time: np.ndarray) -> float:
    """Return the sampling rate of times of shape (n,), n > 1, Hz, the inverse of `usual_interval`."""
    count, seconds = _without_gaps(time)
    return count / seconds


def _without_gaps(time: np.ndarray) -> tuple[int, float]:
    """Return the number of intervals that are not gaps, and their total duration, s."""
    intervals = np.diff(time)
    gaps = intervals[intervals > LONG * np.median(intervals)]
    return len(intervals) - len(gaps), float(time[-1] - time[0] - gaps.sum())


def split_unit(label: str) -> tuple[str, str | None]:
    """Split ``"NDE_A [um]"``, ``"NDE_A (um)"`` or ``"NDE_A_um"`` into name and unit; the unit is None without one.

    ``"Probe 1 (X)"``, ``"NDE (45°)"`` and ``"DE_V"`` are names without a unit.
    """
    name, held = _split_label(label)
    return (name, held) if held is not None and _is_unit(held) else (label.strip(), None)


def names_and_units(
    labels: Sequence[str], split: Callable[[str], tuple[str, str | None]] = split_unit
) -> list[tuple[str, str | None]]:
    """Split labels into names and units; ``"speed_rpm"`` beside ``"speed_Hz"`` keeps its unit in its name."""
    pairs = [split(label) for label in labels]
    alike: dict[str, set[str]] = {}
    for (name, _), label in zip(pairs, labels, strict=True):
        alike.setdefault(name, set()).add(label)
    return [(name if len(alike[name]) == 1 else label, unit) for (name, unit), label in zip(pairs, labels, strict=True)]


def _split_label(label: str) -> tuple[str, str | None]:
    """Split a label into a name and what the brackets or the unit at its end hold."""
    bare = label.strip()
    if (found := _BRACKET.match(bare)) and found.group(1):
        return found.group(1), (found.group(2) if found.group(2) is not None else found.group(3)).strip()
    if found := _SUFFIX.match(bare):
        unit = found.group(2) or found.group(3)
        return found.group(1), unit if unit in ("mV", "kHz") else unit.lower()  # MS are megasiemens
    if (found := _SECONDS_SUFFIX.match(bare)) and _plain(found.group(1)) in _TIME_NAMES | _INTERVAL_NAMES:
        return found.group(1), found.group(2)
    return bare, None


def _is_unit(text: str) -> bool:
    """Tell whether a bracketed text is a unit, as opposed to a value with a unit (``45°``) that unit libraries also accept."""
    number = re.match(r"[-+]?[\d.]", text) is not None and re.match(r"1(?:$|\s*/)", text) is None
    return not number and (is_unit(text) or _PER_SECOND.fullmatch(text) is not None)


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def is_time_name(name: str) -> bool:
    """Tell whether a channel name denotes time, including ``time_2`` and ``Time - NDE``."""
    bare = _split_label(name)[0]
    return (
        _plain(bare) in _TIME_NAMES
        or re.fullmatch(r"(?i)(time|zeit|temps)[\s_\-.:/]*(\d+|axis|.*-\s*\S.*)?", bare) is not None
        or _DEWESOFT.match(bare) is not None
    )


def time_factor(unit: str) -> float | None:
    """Return the conversion factor from a time unit to s; None if it is not a unit of time.

    No unit means s; the epoch in ``"seconds since 2026-03-10"`` is ignored.
    """
    text = unit.strip().split(" since ")[0]
    if text in _NO_UNIT:
        return 1.0
    try:
        return scale(text, "s")
    except InputError:
        return None


def moments(values: np.ndarray, unit: str) -> np.ndarray | None:
    """Return tick counts since 1970 (or 1601 for Windows file time) as datetime64[ns]; None if they are not such counts.

    As floats, the times would lose the digits that distinguish samples.  Without a unit, the tick is inferred from their
    magnitude.  Fractional seconds are left to be read as ordinary times.
    """
    whole = values.dtype.kind in "iu"
    if values.size == 0 or not np.isfinite(values[0]):
        return None
    first, stated = int(values[0]), unit.strip() not in _NO_UNIT
    counted = next(((tick, at) for tick, at in _TICKS if _RECORDED[0] <= (first - at) * tick < _RECORDED[1]), None)
    if counted is None or (not whole and (stated or counted == _SECONDS)):
        return None
    tick, at = counted
    if stated and round((time_factor(unit) or 0.0) * 1e9) != tick:
        return None
    since = (values.astype(np.int64) - first) * tick if whole else np.rint((values - first) * tick)
    return np.datetime64((first - at) * tick, "ns") + since.astype("timedelta64[ns]")


def interval_of(entries: Mapping[str, Any]) -> float | None:
    """Return the sampling interval in s from scalars or attributes that state an interval or a rate; None without any.

    Numbers are in s and Hz; texts may include a unit (``"20 kHz"``).
    """
    intervals = (number for number in _numbers(entries, _INTERVAL_NAMES, "s") if number > 0)
    rates = (number for number in _numbers(entries, _RATE_NAMES, "Hz") if number > 0)
    return next(chain(intervals, (1.0 / rate for rate in rates)), None)


def start_of(entries: Mapping[str, Any]) -> float | None:
    """Return the time of the first sample in s, if stated by scalars or attributes; None otherwise."""
    return next(_numbers(entries, _START_NAMES, "s"), None)


def _numbers(entries: Mapping[str, Any], names: Collection[str], si: str) -> Iterator[float]:
    """Yield the numeric values, converted to the unit `si`, of the entries with one of the given names."""
    for key, entry in entries.items():
        bare, unit = _split_label(str(key))
        if _plain(bare) in names and (number := _number(entry, si, unit)) is not None:
            yield number


def _stated(text: str, si: str, unit: str | None) -> float:
    """Return an interval or rate given as text in the unit `si`; the unit in its name applies if the text has none."""
    in_name = unit or ""
    if si == "Hz":
        text = _in_hz(text)
        if in_name.lower() in ("", "hz"):  # 20.000 Hz means 20 kHz: no drop is recorded at 20 Hz
            text = _THOUSANDS.sub(lambda found: re.sub("[.,]", "", found[0]), text)
    text = _DECIMAL_COMMA.sub(r"\1.", text)
    known = si_unit_of(in_name) if in_name and is_bare(text) else None
    return to_si(text, si) * (known[1] if known is not None and known[0] == si else 1.0)


def _in_hz(text: str) -> str:
    """Return a text with its unit of sampling rates rewritten in Hz: ``kS/s`` becomes ``kHz``."""
    return _PER_SECOND.sub(r"\1Hz", text.strip())


def _number(entry: Any, si: str, unit: str | None) -> float | None:
    if unit and si == "Hz":
        unit = _in_hz(unit)
    try:
        if isinstance(entry, bytes):
            entry = entry.decode("utf-8", "replace")
        if isinstance(entry, str):
            return _stated(entry, si, unit)
        array = np.asarray(entry)
        if array.size != 1 or array.dtype.kind not in "iuf":
            return None
        number = float(array.reshape(-1)[0]) * (scale(unit, si) if unit else 1.0)
    except (InputError, ValueError):
        return None
    return number if math.isfinite(number) else None
