"""Signals for the viewer of an HTML report: minimum and maximum of equal time bins as 16-bit integers, finer around the drop.

A bin without samples has no value, so that gaps in the time axis keep their length.  A speed known once per revolution from a
keyphasor is interpolated.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tdbmon.analysis.unbroken import pieces
from tdbmon.record.timebase import usual_interval

if TYPE_CHECKING:
    from tdbmon.analysis.result import Analysis

_BINS = 4000
_SAMPLES = 6000  # about as many bytes as the bins (two values each): up to here samples are kept unbinned
_SPANS = (4.0, 0.5)  # s after the release, kept at finer resolution
_LEAD = 0.05  # s before it
_NONE = -32768  # no value in the bin


@dataclass(frozen=True)
class Signal:
    """A channel of the viewer: times (n,) in s, values (n,) in `unit`; channels of one `pane` share an axis."""

    name: str
    pane: str
    unit: str
    time: np.ndarray
    values: np.ndarray


@dataclass(frozen=True)
class Signals:
    """Channels of the viewer, the time spans kept at finer resolution, and marks on the time axis."""

    channels: tuple[Signal, ...]
    spans: tuple[tuple[float, float], ...]
    marks: tuple[tuple[str, float], ...]

    def packed(self) -> dict[str, Any]:
        """Return the data for the viewer as plain dictionaries, lists, numbers and strings."""
        return {
            "channels": [
                {"name": c.name, "pane": c.pane, "unit": c.unit, **_packed(c, self.spans)} for c in self.channels
            ],
            "marks": [{"name": name, "at": at} for name, at in self.marks],
        }


def signals_of(analysis: Analysis) -> Signals | None:
    """Return displacement at both ends and the speed; None if the record has neither."""
    channels = []
    if analysis.planes is not None:
        time = analysis.planes.time.to_numpy()
        for end, result in analysis.ends.items():
            if not result.seen:
                continue
            for axis in ("x", "y"):
                values = analysis.planes.displacement.sel(end=end, axis=axis).to_numpy() * 1e6
                channels.append(
                    Signal(f"{end} {axis}", f"displacement at the {result.plane} plane", "µm", time, values)
                )
    if len(analysis.speed_time) > 1:
        time, hz = analysis.speed_time, analysis.speed_hz
        if not _is_sampled(analysis):  # one value per revolution
            even = np.linspace(time[0], time[-1], _SAMPLES)
            time, hz = even, np.interp(even, time, hz)
        channels.append(Signal("speed", "speed", "Hz", time, hz))
    if not channels:
        return None
    release = analysis.released
    begin = float(channels[0].time[0]) if release is None else release
    spans = tuple((begin - _LEAD, begin + span) for span in _SPANS)
    marks = tuple((phase.name, phase.start) for phase in analysis.phases[1:])
    return Signals(tuple(channels), spans, marks)


def _is_sampled(analysis: Analysis) -> bool:
    """True if the speed comes from the record's speed channel (with its gaps), not from the keyphasor's revolutions."""
    record = analysis.record
    return "speed" in record and len(analysis.speed_time) == int(np.isfinite(record["speed"].to_numpy()).sum())


def _packed(channel: Signal, spans: tuple[tuple[float, float], ...]) -> dict[str, Any]:
    """Return scale and levels of resolution, the coarsest first; a level no finer than the one before is left out."""
    finite = channel.values[np.isfinite(channel.values)]
    top, bottom = (float(finite.max()), float(finite.min())) if finite.size else (0.0, 0.0)
    scale = max((top - bottom) / 65000, 1e-12)
    middle = (top + bottom) / 2
    levels: list[dict[str, Any]] = []
    for start, stop in ((channel.time[0], channel.time[-1]), *spans):
        inside = slice(*np.searchsorted(channel.time, [start, stop], side="left") + np.array([0, 1]))
        time, values = channel.time[inside], (channel.values[inside] - middle) / scale
        if len(time) < 2:
            continue
        interval = usual_interval(time)
        place = _places(time, interval)
        places = int(place[-1]) + 1
        bins = places if places <= _SAMPLES else _BINS
        step = interval * places / bins
        if levels and step > 0.7 * levels[-1]["step"]:
            continue
        sides = _envelope(values, place * bins // places, bins)[: 1 if bins == places else 2]
        data = [base64.b64encode(_integers(side)).decode() for side in sides]
        levels.append(
            {
                "start": float(time[0]),
                "step": step,
                "count": bins,
                "low": data[0],
                "high": data[-1] if len(data) > 1 else "",
            }
        )
    return {"scale": scale, "offset": middle, "levels": levels}


def _places(time: np.ndarray, interval: float) -> np.ndarray:
    """Return the indices (n,) that the samples would have on a uniform time axis without gaps."""
    number = np.arange(len(time))
    for piece in pieces(time)[1:]:
        number[piece] += round(float(time[piece.start] - time[0]) / interval) - piece.start
    return number


def _envelope(values: np.ndarray, number: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Return minimum and maximum of each bin, (bins,) each; `number` (n,), ascending, is the bin of each value."""
    filled, first = np.unique(number, return_index=True)
    sides = np.full((2, bins), np.nan)
    sides[0, filled], sides[1, filled] = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
    return sides[0], sides[1]


def _integers(values: np.ndarray) -> bytes:
    whole = np.where(np.isfinite(values), np.rint(np.nan_to_num(values)), _NONE)
    return whole.astype("<i2").tobytes()
