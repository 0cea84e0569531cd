"""Ridges in spectra: peaks that persist in one cell over many windows, their interpolated position, and their speed law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, stdtrit

from tdbmon.analysis import cfar
from tdbmon.analysis.spectrum import cosine_window, window_gain

WINDOW = "blackman-harris"

_LAW = 0.5  # the 95 % interval of the exponent must lie nearer to this law's exponent than to the other's
_NEAR = 0.05  # and must cover it, or the exponent be so near: the swing's frequency depends on its amplitude
_LONG = 1.5  # ratio of speeds over which no broad hump stays in one cell
_UNIFORM = 3.0**2 / 12  # variance of a uniform distribution over three cells
_GAP = 3  # windows without a detection that separate two stretches of a ridge
_TABLE = 1e-4  # interpolation error of the table below, cells

_OFFSET = np.linspace(-0.75, 0.75, 301)
_RATIO = np.log(window_gain(WINDOW, _OFFSET - 1) / window_gain(WINDOW, _OFFSET + 1))  # amplitudes beside the peak
_SLOPE = np.gradient(_OFFSET, _RATIO)
_WEIGHT = cosine_window(WINDOW, 64) ** 2
_CORRELATION = float(np.abs(np.fft.fft(_WEIGHT)[2]) / _WEIGHT.sum())  # of the noise in the two cells beside the peak


@dataclass(frozen=True)
class Spectra:
    """Fourier coefficients over windows that overlap by half.

    Attributes
    ----------
    law : int
        Exponent of the speed with which a line's frequency must vary to stay in its cell: 0 for frequency spectra, 1 for
        order spectra.
    coefficients : ndarray of complex, shape (end, axis, window, cell)
        0-pk, m; Blackman-Harris.
    resolution : float
        Width of a cell, Hz or orders.
    time, speed : ndarray, shape (window,)
        Centre of the window, s, and mean speed over it, Hz (NaN where unknown).
    gain : ndarray, shape (window, cell)
        Gain for a tone there.
    """

    law: int
    coefficients: np.ndarray
    resolution: float
    time: np.ndarray
    speed: np.ndarray
    gain: np.ndarray


@dataclass(frozen=True)
class Ridge:
    """A line in the spectra of one channel.

    Attributes
    ----------
    window : ndarray of int, shape (n,)
        Windows in which it is detected.
    place, sigma : ndarray, shape (n,)
        Frequency (Hz) or order there, and its standard deviation due to noise.
    power : ndarray, shape (n,)
        Amplitude squared, m^2.
    first, last : int
        First and last window of the detection, including windows removed later.
    """

    window: np.ndarray
    place: np.ndarray
    sigma: np.ndarray
    power: np.ndarray
    first: int
    last: int

    @property
    def middle(self) -> float:
        """Median frequency (Hz) or order."""
        return float(np.median(self.place))

    def at(self, keep: np.ndarray) -> Ridge:
        """Return the ridge restricted to some of its windows."""
        return Ridge(self.window[keep], self.place[keep], self.sigma[keep], self.power[keep], self.first, self.last)

    def mean(self) -> tuple[float, float]:
        """Return the mean frequency or order and the half-width of its 95 % interval.

        Values scatter by noise and because the line moves (a swing's frequency depends on its amplitude): random-effects
        model (R. DerSimonian and N. Laird, Controlled Clin. Trials 7, 1986, 177-188) with the interval of G. Knapp
        and J. Hartung (Stat. Med. 22, 2003, 2693-2710).
        """
        n = len(self.place)
        w = 1 / self.sigma**2
        centre = np.sum(w * self.place) / w.sum()
        excess = np.sum(w * (self.place - centre) ** 2) - (n - 1)
        between = max(0.0, excess / (w.sum() - np.sum(w**2) / w.sum()))
        w = 1 / (self.sigma**2 + between)
        mean = np.sum(w * self.place) / w.sum()
        scale = max(1.0, np.sum(w * (self.place - mean) ** 2) / (n - 1))
        return float(mean), float(stdtrit(n - 1, 0.975) * np.sqrt(scale / w.sum()))


def find_ridges(spectra: Spectra) -> tuple[list[list[list[Ridge]]], np.ndarray]:
    """Find the ridges of every end and axis whose frequency follows the speed law of the spectra.

    Returns
    -------
    ridges : list
        By end and axis.
    floor : ndarray, shape (end, axis, window, cell)
        Noise floor: mean power around each cell, m^2.
    """
    rate = cfar.cell_rate(spectra.coefficients.size)
    floor = np.full(spectra.coefficients.shape, np.nan)
    out: list[list[list[Ridge]]] = []
    for e, end in enumerate(spectra.coefficients):
        out.append([])
        for a, coefficients in enumerate(end):
            power = np.nan_to_num(np.abs(coefficients) ** 2)
            found, floor[e, a] = cfar.detect(power, rate)
            ridges = _ridges(power, found, floor[e, a], spectra.resolution)
            out[-1].append([r for r in ridges if _obeys(r, spectra)])
    return out, floor


def _ridges(power: np.ndarray, found: np.ndarray, floor: np.ndarray, resolution: float) -> list[Ridge]:
    near = found.copy()  # the maximum of a line between two cells alternates between them
    near[:, 1:] |= found[:, :-1]
    near[:, :-1] |= found[:, 1:]
    if len(near) < cfar.WINDOWS:
        return []
    total = np.cumsum(np.pad(near, ((1, 0), (0, 0))), axis=0, dtype=np.int32)
    run = total[cfar.WINDOWS :] - total[: -cfar.WINDOWS] >= cfar.HITS
    cells = np.flatnonzero(run.any(axis=0))
    used = np.zeros((len(near), cells.size), dtype=bool)
    for i in range(cfar.WINDOWS):
        used[i : i + len(run)] |= run[:, cells]
    used &= near[:, cells]
    hits, strength = used.sum(axis=0), (used * power[:, cells]).sum(axis=0)
    ridges, taken = [], np.zeros(power.shape[1], dtype=bool)
    for i in np.lexsort((-strength, -hits)):
        if not taken[cells[i] - 1 : cells[i] + 2].any():
            taken[cells[i]] = True
            ridges.append(_ridge(power, found, floor, np.flatnonzero(used[:, i]), cells[i], resolution))
    return ridges


def _ridge(
    power: np.ndarray, found: np.ndarray, floor: np.ndarray, window: np.ndarray, cell: int, resolution: float
) -> Ridge:
    """Return the ridge of one cell, its position interpolated from the power ratio of the two cells beside the peak."""
    beside = cell + np.arange(-1, 2)
    here = power[window[:, None], beside] * found[window[:, None], beside]
    place, sigma, height = peak_place(power, floor, window, beside[np.argmax(here, axis=1)])
    return Ridge(window, place * resolution, sigma * resolution, height, int(window[0]), int(window[-1]))


def peak_place(
    power: np.ndarray, floor: np.ndarray, window: np.ndarray, peak: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return position and its standard deviation, cells, and squared amplitude of peaks in cells (n,) of windows (n,).

    The ratio of the two cells beside the peak does not depend on the phase of the line.
    """
    left, right = power[window, peak - 1], power[window, peak + 1]
    ratio = np.log(right / left) / 2
    offset = np.interp(ratio, _RATIO, _OFFSET)
    noise = floor[window, peak]
    variance = noise / 2 * (1 / right + 1 / left - 2 * _CORRELATION / np.sqrt(left * right))
    sigma = np.hypot(np.interp(ratio, _RATIO, _SLOPE) * np.sqrt(variance), _TABLE)
    height = power[window, peak] / window_gain(WINDOW, offset) ** 2
    return peak + offset, sigma, height


def _obeys(ridge: Ridge, spectra: Spectra) -> bool:
    """Return True if the ridge follows the law of its spectra (exponent 0 or 1 of the speed) and the other one is excluded.

    The exponent is tested twice: over the whole ridge, and within its stretches only, since two lines that sweep through
    a cell one after the other form a ridge that is level as a whole.
    """
    speed = spectra.speed[ridge.window]
    known = np.isfinite(speed) & (speed >= 0)
    if known.sum() < cfar.HITS or not speed[known].mean() > 0:
        return False
    if not (_is_narrow(ridge, spectra.resolution) or speed[known].max() > _LONG * speed[known].min()):
        return False
    # regress on ln(speed) for orders, on the speed itself for frequencies, since it may reach zero
    x = np.log(speed[known]) if spectra.law else speed[known] / speed[known].mean()
    y, w = ridge.place[known], 1 / ridge.sigma[known] ** 2
    stretch = np.concatenate([[0], np.cumsum(np.diff(ridge.window[known]) > _GAP)])
    return all(_follows(x, y, w, group) for group in (np.zeros_like(stretch), stretch))


def _is_narrow(ridge: Ridge, resolution: float) -> bool:
    """Return True if its positions scatter less than noise peaks uniform over three cells, at the 0.1 % level.

    A broad hump that drifts through the cells has many such peaks, and stays in one cell for a while.
    """
    n = len(ridge.place)
    return bool(np.var(ridge.place, ddof=1) < _UNIFORM * resolution**2 * chdtri(n - 1, 0.999) / (n - 1))


def _follows(x: np.ndarray, y: np.ndarray, w: np.ndarray, group: np.ndarray) -> bool:
    """Return True if y does not depend on x within the groups, by weighted least squares with a mean for each."""
    weight = np.bincount(group, w)
    dx = x - (np.bincount(group, w * x) / weight)[group]
    dy = y - (np.bincount(group, w * y) / weight)[group]
    spread = np.sum(w * dx**2)
    freedom = len(x) - len(weight) - 1
    if freedom < 1 or not spread > 0:
        return False
    slope = np.sum(w * dx * dy) / spread
    scatter = max(1.0, np.sum(w * (dy - slope * dx) ** 2) / freedom)
    mean = np.sum(w * y) / w.sum()
    exponent, half = slope / mean, stdtrit(freedom, 0.975) * np.sqrt(scatter / spread) / mean
    return bool(abs(exponent) + half < _LAW and abs(exponent) < max(half, _NEAR))
