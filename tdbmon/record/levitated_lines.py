"""Spectral lines of the levitated shaft before the drop, above all the 1X line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.machine import Machine

_FALLEN = 0.3  # of the radial gap: a shaft that has moved this far is no longer levitated
_LIES, _UPRIGHT = 0.7, 0.5  # of the gap below the probes' zero, by all probes whose angle has at least this sine
_START_S = 10e-3  # start of the record that gives the levitated position
_LEAST_S = 40e-3  # of levitation, required to resolve lines
_MOST_S = 0.25  # of levitation used: a shaft coasting at 200 Hz then slows by no more than one bin
STANDS_OUT = 16.0  # times the median power around it: false-alarm probability 1 in 65 000
STRONG = 100.0  # the same, required of a line that contradicts the stated speed
_AROUND = (3.0, 25.0)  # resolution bins on either side that give the background power
_NEAR = 0.75  # bins: tolerance for a line at a given frequency
_RESOLVED = 3  # bins: a lower speed cannot be told from drift
_APART = 0.3  # bins: closer lines, one of which is strong, cannot be told apart
_MAINS = 12  # harmonics
WIDTH = 1.5  # bins: half width of a line with the Hann window


@dataclass(frozen=True)
class LevitatedLines:
    """Power spectrum of the displacements before the shaft falls, summed over all probes.

    Attributes
    ----------
    hz, power : numpy.ndarray, shape (n,)
        Frequency, Hz, in steps of a quarter of `cell` (zero padding), and power.
    cell : float
        Resolution, Hz: the bin width without zero padding.
    each : numpy.ndarray, shape (probes, n)
        Power of each probe.
    time : numpy.ndarray, shape (m,)
        Times of the levitated stretch, s.
    levels : numpy.ndarray, shape (probes, m)
        Displacements in this stretch after linear detrending, m.
    """

    hz: np.ndarray
    power: np.ndarray
    cell: float
    each: np.ndarray
    time: np.ndarray
    levels: np.ndarray

    def at(self, hz: float) -> float:
        """Return the largest power close to a frequency; 0 outside the range that the spectrum resolves."""
        return float(self._heights(self.power[None], hz)[0])

    def contrast(self, hz: float) -> float:
        """Return the ratio of a line's power to the background; 0 where the spectrum does not resolve it."""
        usual = self.usual(hz)
        return self.at(hz) / usual if usual > 0 else 0.0

    def usual(self, hz: float) -> float:
        """Return the background, the median power around a line; 0 outside the spectrum."""
        far = np.abs(self.hz - hz) / self.cell
        around = self.power[(far > _AROUND[0]) & (far < _AROUND[1])]
        return float(np.median(around)) if around.size else 0.0

    def bears_out(self, hz: float) -> bool:
        """Tell whether there is a line at this frequency: a peak, not the flank of a neighbouring line."""
        off = np.abs(self.hz - hz) / self.cell
        flank = self.power[(off >= _NEAR) & (off < WIDTH)]
        return self.contrast(hz) > STANDS_OUT and bool(self.at(hz) >= flank.max(initial=0.0))

    def outdoes(self, hz: float, other: float, times: float) -> bool:
        """Tell whether there is a strong line at `hz` with more than `times` the power at `other`."""
        return self.contrast(hz) > STRONG and self.at(hz) > times * self.at(other)

    def outdoes_in_most(self, hz: float, other: float, times: float) -> bool:
        """Tell whether `outdoes` holds in sum and in more than half of the probes, so that one disturbed probe cannot decide."""
        clear = self._heights(self.each, hz) > times * self._heights(self.each, other)
        return self.outdoes(hz, other, times) and bool(np.mean(clear) > 0.5)

    def resolves(self, hz: float) -> bool:
        """Tell whether the spectrum resolves a line at this frequency."""
        return _RESOLVED * self.cell < hz < float(self.hz[-1])

    def strongest(self, mains_hz: float) -> float:
        """Return the frequency of the strongest line other than mains hum, Hz."""
        kept = np.where(self.hum(self.hz, mains_hz) | (self.hz < _RESOLVED * self.cell), 0.0, self.power)
        return float(self.hz[int(np.argmax(kept))])

    def _heights(self, power: np.ndarray, hz: float) -> np.ndarray:
        near = np.abs(self.hz - hz) < _NEAR * self.cell
        if not near.any() or hz <= 2 * self.cell:
            return np.zeros(len(power))
        return np.asarray(power[:, near].max(axis=1))

    def is_hum(self, hz: float, mains_hz: float) -> bool:
        """Tell whether the line at a frequency may be mains hum; a strong line is located to a fraction of a bin."""
        if not self.hum(np.array([hz]), mains_hz)[0]:
            return False
        off = abs(hz - np.rint(hz / mains_hz) * mains_hz)
        return off < _APART * self.cell or abs(self._peak(hz) - hz) > 0.5 * off

    def _peak(self, hz: float) -> float:
        """Return the frequency of the line near `hz`, from a parabola through the log power of the peak and its neighbours."""
        near = np.flatnonzero(np.abs(self.hz - hz) < _NEAR * self.cell)
        top = int(near[np.argmax(self.power[near])])
        if not 0 < top < len(self.hz) - 1:
            return float(self.hz[top])
        shift = vertex(self.power[top - 1 : top + 2])
        return float(self.hz[top] + shift * (self.hz[1] - self.hz[0]))

    def hum(self, hz: np.ndarray, mains_hz: float) -> np.ndarray:
        """Return a mask of the frequencies (n,), Hz, that cannot be told from the mains frequency and its harmonics."""
        order = np.rint(hz / mains_hz)
        return (order >= 1) & (order <= _MAINS) & (np.abs(hz - order * mains_hz) < WIDTH * self.cell)


def vertex(power: np.ndarray) -> float:
    """Return the vertex of a parabola through the logarithms of three powers, in steps from the middle one."""
    left, middle, right = np.log(np.maximum(power, 1e-300))
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0


def levitated_lines(ds: xr.Dataset, machine: Machine) -> LevitatedLines | None:
    """Return the power spectrum of the levitated shaft; None if the record contains too little levitation.

    A Hann window covers the stretch from the first sample until a probe is about to move by 0.3 gaps.  If none ever does and
    the shaft lies low in its clearance, it fell before the record began and oscillates at other frequencies: None.
    """
    rows: list[np.ndarray] = []
    low_all_along: list[bool] = []
    dimension, time, until = "", np.empty(0), 0
    for probe in machine.probes:
        if probe.name not in ds or (rows and str(ds[probe.name].dims[0]) != dimension):
            continue
        if not rows:
            dimension = str(ds[probe.name].dims[0])
            time = ds[dimension].values
            if len(time) < 64 or time[-1] - time[0] < _LEAST_S:
                return None
            until = int(np.searchsorted(time, time[0] + _MOST_S, side="right"))
        row = ds[probe.name].values
        start = time < time[0] + _START_S
        if not np.isfinite(row[start]).any():
            continue
        low, high = np.nanmin(row[start]), np.nanmax(row[start])
        gap, upright = machine.bearing(probe.end).radial_gap.nominal, float(np.sin(probe.angle))
        reach = _FALLEN * gap
        away = np.flatnonzero((row < low - reach) | (row > high + reach))
        if away.size:
            falling = 1.2 * np.sqrt(2 * reach / max(machine.gravity, 1.0))  # duration of the fall to there, with a margin
            until = min(until, int(np.searchsorted(time, time[away[0]] - falling)))
        if away.size or abs(upright) > _UPRIGHT:
            low_all_along.append(not away.size and -np.nanmedian(row) / upright > _LIES * gap)
        rows.append(row)
    if low_all_along and all(low_all_along):
        return None
    if not rows or time[max(until - 1, 0)] - time[0] < _LEAST_S:
        return None
    # a constant channel has no lines, but its rounding errors would
    whole = [row[:until] for row in rows if np.isfinite(row[:until]).all() and np.ptp(row[:until]) > 0]
    if not whole:
        return None
    seconds = float(time[until - 1] - time[0]) * until / (until - 1)
    since = np.linspace(-1.0, 1.0, until)
    size = 4 * until
    levels = np.array([row - np.polyval(np.polyfit(since, row, 1), since) for row in whole])
    each = np.abs(np.fft.rfft(levels * np.hanning(until), size)) ** 2
    hz = np.fft.rfftfreq(size, seconds / until)
    return LevitatedLines(hz, each.sum(axis=0), 1 / seconds, each, time[:until], levels)
