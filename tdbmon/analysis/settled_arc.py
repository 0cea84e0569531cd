"""Arc along which the settled shaft swings: mean radius and load by angle bin, from positions and accelerations.

Each angle bin is averaged in blocks of time, whose scatter gives its standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tdbmon.analysis.unbroken import pieces

_LOWPASS_HZ = 300.0  # only accelerations are smoothed; the arc itself needs the swing's harmonics
_SOLVED = 3  # angle bins; with fewer the circle is not determined
_RATE_HZ = 2500.0
_ROUNDING = 1e-6  # keeps rounding of a rate computed from times from lowering a whole number
BIN_DEG = 3.0
_UNSEEN = 2  # a bin seen in so few blocks of time is not used; its weight grows from there
_USUAL = 10  # blocks: prior weight of the bins' usual scatter, as few blocks determine a bin's own poorly
_PARTS = 12
_BLOCK_S = 0.05  # longer than a swing period, so that blocks are taken as independent


@dataclass(frozen=True)
class Steady:
    """Positions of the settled shaft (n, 2), m, accelerations of the mass it carries (n, 2), m/s^2, and blocks of time (n,)."""

    xy: np.ndarray
    acceleration: np.ndarray
    block: np.ndarray

    @classmethod
    def of(cls, time: np.ndarray, xy: np.ndarray, carried: np.ndarray, rate: float) -> Steady:
        """Return the settled motion, decimated by averaging to about `_RATE_HZ`, far above swing harmonics and bounce frequency.

        Missing samples and gaps in the time axis separate pieces, across which no acceleration is computed.
        """
        count = max(1, int(rate / _RATE_HZ + _ROUNDING))
        rate /= count
        both = np.hstack([xy, carried])
        averaged = [_averaged(time[piece], both[piece], count) for piece in pieces(time)]
        time, both = (np.concatenate(column) for column in zip(*averaged, strict=True))
        seen = np.isfinite(both).all(axis=1)
        time, xy, carried = time[seen], both[seen, :2], both[seen, 2:]
        number = np.round((time - time[:1]) * rate).astype(int)
        acceleration = np.full(xy.shape, np.nan)
        for piece in pieces(time):
            if piece.stop - piece.start >= max(3.0, rate / _LOWPASS_HZ):  # or too short for an acceleration
                acceleration[piece] = _acceleration(carried[piece], number[piece] - number[piece.start], rate)
        kept = np.isfinite(acceleration).all(axis=1)
        return cls(xy[kept], acceleration[kept], number[kept] // max(int(_BLOCK_S * rate + _ROUNDING), 1))


@dataclass(frozen=True)
class Arc:
    """Mean radius, m, and load, over the static one, by bin of the angle from the bottom, rad; `sigma` of the radius, m.

    `sigma` is estimated from the scatter between blocks of time.
    """

    angle: np.ndarray
    radius: np.ndarray
    load: np.ndarray
    sigma: np.ndarray


@dataclass(frozen=True)
class Cells:
    """Settled positions about a centre, averaged over cells of one angle bin and one block of time."""

    centre: np.ndarray
    halfwidth: float
    bin: np.ndarray
    block: np.ndarray
    means: np.ndarray  # (cell, 3): angle from the bottom, radius, load

    @classmethod
    def of(cls, steady: Steady, gravity: float, circle: np.ndarray) -> Cells:
        """Return the averages about the centre of a circle (x, y, ...), m."""
        block = steady.block
        d = steady.xy - circle[:2]
        r = np.hypot(d[:, 0], d[:, 1])
        angle = np.arctan2(d[:, 0], -d[:, 1])
        outward = np.sum(steady.acceleration * d, axis=1) / r
        load = np.cos(angle) - outward / gravity if gravity > 0 else np.ones_like(r)
        bins = np.round(np.rad2deg(angle) / BIN_DEG).astype(int)
        bins -= bins.min()
        blocks = int(block.max()) + 1
        cell, inverse = np.unique(bins * blocks + block, return_inverse=True)
        count = np.bincount(inverse)
        means = np.column_stack([np.bincount(inverse, v) / count for v in (angle, r, load)])
        halfwidth = float(np.quantile(np.abs(angle), 0.98))
        return cls(circle[:2].copy(), halfwidth, cell // blocks, cell % blocks, means)

    def parts(self) -> list[Arc]:
        """Return the jackknife arcs, each without one part of the time; none if one of them does not determine a circle.

        The circle then depends on the omitted part, whose error cannot be estimated.
        """
        blocks = np.unique(self.block)
        shares = np.array_split(blocks, min(_PARTS, len(blocks)))
        left = []
        for share in shares:
            kept = ~np.isin(self.block, share)
            left.append(replace(self, bin=self.bin[kept], block=self.block[kept], means=self.means[kept]).arc())
        return left if all(len(arc.angle) >= _SOLVED for arc in left) else []

    def arc(self) -> Arc:
        """Return the averages over the blocks, without bins seen in fewer than three, which give no estimate of their error.

        Nor do three blocks that happen to agree make a bin certain: at the ends of the arc, where bins hold few samples, it would
        tilt the circle.  The variance of each bin is shrunk towards the usual one, and its weight rises gradually from zero.
        """
        bins = [self.means[self.bin == b] for b in np.unique(self.bin)]
        bins = [means for means in bins if len(means) > _UNSEEN]
        if not bins:
            return Arc(*np.empty((4, 0)))
        off = [np.abs(means[:, 1] - np.median(means[:, 1])) for means in bins]
        own, count = 1.4826 * np.array([np.median(each) for each in off]), np.array([len(means) for means in bins])
        spread = np.sqrt((count * own**2 + _USUAL * np.median(own) ** 2) / (count + _USUAL)) + 1e-8
        kept = [means[each < 3 * limit].mean(axis=0) for means, each, limit in zip(bins, off, spread, strict=True)]
        return Arc(*np.column_stack([kept, spread / np.sqrt(count - _UNSEEN)]).T)


def _averaged(time: np.ndarray, xy: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    whole = len(xy) // count * count
    return time[:whole].reshape(-1, count).mean(axis=1), xy[:whole].reshape(-1, count, xy.shape[1]).mean(axis=1)


def _acceleration(xy: np.ndarray, number: np.ndarray, rate: float) -> np.ndarray:
    """Return the smoothed acceleration at the samples of these numbers; the few missing ones are interpolated linearly."""
    every = np.arange(number[-1] + 1)
    line = xy if len(every) == len(xy) else np.column_stack([np.interp(every, number, row) for row in xy.T])
    velocity = np.gradient(_lowpass(line, rate), axis=0) * rate
    return np.asarray(np.gradient(velocity, axis=0) * rate)[number]


def _lowpass(data: np.ndarray, rate: float) -> np.ndarray:
    """Return data after a zero-phase low-pass at `_LOWPASS_HZ` (in the frequency domain, with odd reflection at the ends)."""
    from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

    pad = min(len(data) - 1, int(0.1 * rate))
    head, tail = 2 * data[0] - data[pad:0:-1], 2 * data[-1] - data[-2 : -pad - 2 : -1]
    long = np.concatenate([head, data, tail]).T
    n = next_fast_len(long.shape[1], real=True)
    spectrum = rfft(long, n) / (1 + (rfftfreq(n, 1 / rate) / _LOWPASS_HZ) ** 8)
    return np.asarray(irfft(spectrum, n)[:, pad : pad + len(data)]).T
