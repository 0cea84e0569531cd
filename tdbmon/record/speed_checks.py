"""Checks of the speed: signal, keyphasor and the line that the levitated shaft draws must tell of one and the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.record.finding import Check
from tdbmon.record.keyphasor import Pulses, pulses, speed

_SPEED_LIMIT = 3000.0  # Hz: 180 000 rpm
_SAME = 0.03  # relative: of speeds that are one
_FALLEN = 0.3  # of the radial gap: a shaft that has moved so far levitates no more
_START_S = 10e-3  # that shows where the shaft levitates
_LEAST_S = 40e-3  # of levitation, for a line to be told from its neighbours
_STANDS_OUT = 16.0  # times the median power around it: chance lets one line in 65 000 do so
_STRONG = 100.0  # the same, for a line that contradicts the speed
_STRONGER = 25.0  # times the power at a speed that no second channel doubts
_LIKELIER = 4.0  # times the power at the one of two speeds that differ: twice the amplitude, as 1X has over 2X
_AROUND = (3.0, 25.0)  # cells of the spectrum to either side that tell what is usual there
_WIDTH = 1.5  # cells: half of a line's width under the window
_NEAR = 0.75  # cells: within which a line is at a frequency
_MAINS = 12  # harmonics
_UNITS = {
    60.0: "rpm written as Hz",
    1 / 60: "Hz written as rpm",
    2 * np.pi: "rad/s written as Hz",
    1 / (2 * np.pi): "Hz written as rad/s",
}
_COUNTS = {2.0: "two pulses a revolution in the speed signal", 0.5: "two marks a revolution on the shaft"}


@dataclass(frozen=True)
class LevitatedLines:
    """Spectrum of the displacements before the shaft falls, all probes together.

    Attributes
    ----------
    hz, power : numpy.ndarray, shape (n,)
    cell : float
        Resolution, Hz.
    """

    hz: np.ndarray
    power: np.ndarray
    cell: float

    def at(self, hz: float) -> float:
        """Greatest power within a line's width, and nought outside what the spectrum resolves."""
        near = np.abs(self.hz - hz) < _NEAR * self.cell
        return float(self.power[near].max()) if near.any() and hz > 2 * self.cell else 0.0

    def contrast(self, hz: float) -> float:
        """Power of a line over the median of what lies around it; nought where the spectrum does not resolve it."""
        far = np.abs(self.hz - hz) / self.cell
        around = self.power[(far > _AROUND[0]) & (far < _AROUND[1])]
        usual = float(np.median(around)) if around.size else 0.0
        return self.at(hz) / usual if usual > 0 else 0.0

    def bears_out(self, hz: float) -> bool:
        """Whether a line stands at this frequency: a peak, and no flank of a neighbour."""
        off = np.abs(self.hz - hz) / self.cell
        flank = self.power[(off >= _NEAR) & (off < _WIDTH)]
        return self.contrast(hz) > _STANDS_OUT and bool(self.at(hz) >= flank.max(initial=0.0))

    def outdoes(self, hz: float, other: float, times: float) -> bool:
        """Whether a strong line stands at `hz`, of more than so many times the power at `other`."""
        return self.contrast(hz) > _STRONG and self.at(hz) > times * self.at(other)

    def strongest(self, mains_hz: float) -> float:
        """Frequency of the strongest line that is not of the mains, Hz."""
        kept = np.where(self.hum(self.hz, mains_hz) | (self.hz < 3 * self.cell), 0.0, self.power)
        return float(self.hz[int(np.argmax(kept))])

    def hum(self, hz: np.ndarray, mains_hz: float) -> np.ndarray:
        """Which frequencies (n,), Hz, cannot be told from the mains and its harmonics."""
        order = np.rint(hz / mains_hz)
        return (order >= 1) & (order <= _MAINS) & (np.abs(hz - order * mains_hz) < _WIDTH * self.cell)


def levitated_lines(ds: xr.Dataset, machine: Machine) -> LevitatedLines | None:
    """Return the spectrum of the levitated shaft; None where the record holds too little of it.

    A window of Hann over the stretch from the first sample until a probe has moved by a third of the gap.
    """
    rows: list[np.ndarray] = []
    dimension, time, until = "", np.empty(0), 0
    for probe in machine.probes:
        if probe.name not in ds or (rows and str(ds[probe.name].dims[0]) != dimension):
            continue
        if not rows:
            dimension = str(ds[probe.name].dims[0])
            time = ds[dimension].values
            if len(time) < 64 or time[-1] - time[0] < _LEAST_S:
                return None
            until = len(time)
        row = ds[probe.name].values
        start = time < time[0] + _START_S
        if not np.isfinite(row[start]).any():
            continue
        low, high = np.nanmin(row[start]), np.nanmax(row[start])
        reach = _FALLEN * machine.bearing(probe.end).radial_gap.nominal
        away = np.flatnonzero((row < low - reach) | (row > high + reach))
        if away.size:
            falling = 1.2 * np.sqrt(2 * reach / max(machine.gravity, 1.0))  # what the fall to there took, and some more
            until = min(until, int(np.searchsorted(time, time[away[0]] - falling)))
        rows.append(row)
    if not rows or time[max(until - 1, 0)] - time[0] < _LEAST_S:
        return None
    whole = [row[:until] for row in rows if np.isfinite(row[:until]).all()]
    if not whole:
        return None
    seconds = float(time[until - 1] - time[0]) * until / (until - 1)
    since = np.linspace(-1.0, 1.0, until)
    size = 4 * until
    power = np.zeros(size // 2 + 1)
    for row in whole:
        level = row - np.polyval(np.polyfit(since, row, 1), since)
        power += np.abs(np.fft.rfft(level * np.hanning(until), size)) ** 2
    return LevitatedLines(np.fft.rfftfreq(size, seconds / until), power, 1 / seconds)


def first_speed(ds: xr.Dataset, marks: Pulses | None) -> float | None:
    """Return the speed at the start of a record, Hz, of the keyphasor or else of the speed signal."""
    if marks is not None and marks.times.size > 4:
        return float(np.median(speed(marks)[1][:4]))
    return _signal_at_start(ds)


def speed_check(ds: xr.Dataset, machine: Machine, marks: Pulses | None) -> Check:
    """Check the speed signal against the keyphasor, or else against the line of the levitated shaft."""
    values = ds["speed"].values
    good = np.isfinite(values)
    if not good.any():
        return Check("speed", "speed", False, "holds no value: check the channel")
    compared = _over_pulses(ds, marks)
    if compared is not None:
        if compared.agree:
            return Check("speed", "speed", True, f"agrees with the keyphasor within {abs(compared.ratio - 1):.2%}")
        kind = _named(compared.ratio)
        why = f", {kind}" if kind else ""
        wrong = refuted(ds, machine)
        judged = (
            f". The levitated shaft bears out the {_other(wrong)}: the {_called(wrong)} is left out" if wrong else ""
        )
        cure = "check unit and sensitivity of the speed signal, and the mark"
        return Check("speed", "speed", False, f"{compared.ratio:.4g} times the keyphasor's speed{why}: {cure}{judged}")
    largest = float(np.max(np.abs(values[good])))
    if largest > _SPEED_LIMIT:
        detail = f"up to {largest:.4g} Hz ({largest * 60:.4g} rpm): rpm written as Hz? Check its unit"
        return Check("speed", "speed", False, detail + (_UNUSED if refuted(ds, machine) else ""))
    return _against_the_shaft(ds, machine) or Check("speed", "speed", True, f"up to {largest:.4g} Hz")


_UNUSED = ". It is left out: nothing is said about the speed"


def _against_the_shaft(ds: xr.Dataset, machine: Machine) -> Check | None:
    """A speed signal alone must stand among the levitated shaft's lines; None where that cannot be told."""
    lines, stated = levitated_lines(ds, machine), _signal_at_start(ds)
    if lines is None or stated is None or stated <= 0:
        return None
    cure = "check unit and sensitivity of the speed signal"
    factor = _unit_factor(lines, stated, machine.mains)
    if factor is not None:
        detail = f"{stated:.4g} Hz at the start, but the levitated shaft turns at {stated / factor:.4g} Hz"
        return Check("speed", "speed", False, f"{detail}: {_UNITS[factor]}? {cure.capitalize()}{_UNUSED}")
    if lines.bears_out(stated):
        return Check("speed", "speed", True, f"{stated:.4g} Hz: the levitated shaft draws a line there")
    other = lines.strongest(machine.mains)
    if abs(other - stated) < _WIDTH * lines.cell or not lines.outdoes(other, stated, _STRONGER):
        return None
    detail = (
        f"{stated:.4g} Hz at the start, but the levitated shaft draws no line there, and a strong one at {other:.4g} Hz"
    )
    return Check("speed", "speed", False, f"{detail} ({stated / other:.4g} times): {cure}")


def _unit_factor(lines: LevitatedLines, stated: float, mains_hz: float) -> float | None:
    """Return the unit's factor by which a speed reads too much, by a line where the shaft would then turn."""

    def possible(factor: float) -> bool:
        true = stated / factor
        hum = bool(lines.hum(np.array([true]), mains_hz)[0])
        return lines.outdoes(true, stated, _STRONGER) and not (hum and lines.bears_out(stated))

    return max(filter(possible, _UNITS), key=lambda factor: lines.at(stated / factor), default=None)


def refuted(ds: xr.Dataset, machine: Machine) -> str:
    """Return which channel of the speed is wrong: "speed", "keyphasor", or "" where that is not decided.

    Signal and keyphasor that differ are judged by the lines of the levitated shaft at the one and at the other.  A signal
    alone is refuted where the shaft's line is a unit's factor away.
    """
    marks = _marks(ds, machine)
    lines, stated = levitated_lines(ds, machine), _signal_at_start(ds)
    if lines is None or stated is None or stated <= 0:
        return ""
    compared = _over_pulses(ds, marks)
    if compared is None:
        return "speed" if _unit_factor(lines, stated, machine.mains) is not None else ""
    if compared.agree:
        return ""
    counted = stated / compared.ratio
    if lines.outdoes(counted, stated, _LIKELIER):
        return "speed"
    return "keyphasor" if lines.outdoes(stated, counted, _LIKELIER) else ""


def without_refuted(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a record without the channel of the speed that the others refute (see `refuted`)."""
    wrong = refuted(ds, machine)
    return ds.drop_vars(wrong) if wrong else ds


def require_one_speed(ds: xr.Dataset, machine: Machine, name: str) -> None:
    """Raise InputError where the speed cannot be told: a model fitted to a wrong one would be wrong throughout.

    Parameters
    ----------
    ds : xarray.Dataset
        From `without_refuted`.
    machine : Machine
    name : str
        Of the record, for the message.
    """
    compared = _over_pulses(ds, _marks(ds, machine))
    if compared is not None and not compared.agree:
        raise InputError(
            f"{name}: the speed signal reads {compared.ratio:.4g} times the keyphasor's speed, and the levitated shaft does"
            " not tell which is right: correct unit or sensitivity of the speed signal, or take the wrong one of the two"
            " out of the machine file"
        )


@dataclass(frozen=True)
class _Ratio:
    """Speed of the signal over that of the pulses, and whether they are one."""

    ratio: float
    agree: bool


def _over_pulses(ds: xr.Dataset, marks: Pulses | None) -> _Ratio | None:
    if "speed" not in ds or marks is None or marks.times.size <= 4:
        return None
    values, time = ds["speed"].values, ds[ds["speed"].dims[0]].values
    good = np.isfinite(values)
    if not good.any():
        return None
    at, hz, sigma = speed(marks)
    ratio = float(np.median(np.interp(at, time[good], values[good]) / hz))
    return _Ratio(ratio, abs(ratio - 1) <= max(_SAME, 3 * float(np.median(sigma / hz))))


def _marks(ds: xr.Dataset, machine: Machine) -> Pulses | None:
    return pulses(ds, machine) if "keyphasor" in ds and machine.keyphasor is not None else None


def _signal_at_start(ds: xr.Dataset) -> float | None:
    if "speed" not in ds:
        return None
    start = ds["speed"].values[:50]
    return float(np.nanmedian(start)) if np.isfinite(start).any() else None


def _named(ratio: float) -> str:
    """Return the fault that makes a speed read about `ratio` times too much, or nothing."""
    kinds = _UNITS | _COUNTS
    nearest = min(kinds, key=lambda each: abs(np.log(max(abs(ratio), 1e-9) / each)))
    return kinds[nearest] if 0.9 < abs(ratio) / nearest < 1.1 else ""


def _called(channel: str) -> str:
    return "speed signal" if channel == "speed" else channel


def _other(channel: str) -> str:
    return "keyphasor" if channel == "speed" else "speed signal"
