"""The laws before and after a release, for both ends: the orbit in levitation, and the fall that grows out of it.

Where the magnetic force dies away as exp(-t/T) instead of at once, what it held is let go as 1 - exp(-t/T): weight, the
turning of the shaft about its inertia axis, and the sag in the lowest bending modes alike.  An acceleration exp(s t) from rest
is the path (exp(s t) - 1 - s t) / s^2, so all of it is closed.  With the instant t0 and T given, the rest is linear; which
instant and T are right is sought by `tdbmon.analysis.release_search`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdbmon.analysis.spring_back import SpringBack

Array = NDArray[np.float64]

WIDE = 10e-6  # m, 0-pk: an orbit of a bent or badly balanced shaft, which turns on in the fall about as widely
_SAG = 1.0  # of gravity over the square of a bending mode's angular frequency, standard deviation: the sag that springs back


class _Laws(NamedTuple):
    """What a fit to an instant needs: columns (k, p), normal matrix (p, p), and the fall as gravity and sag have it (2 n, k)."""

    design: Array
    normal: Array
    fall: Array


@dataclass(frozen=True, eq=False)
class ReleaseFit:
    """The laws before and after an instant, linear in all but that and the force's decay time.

    Attributes
    ----------
    t : (k,) array
        Time, s, from the levitated stretch into the fall.
    data : (2 n, k) array
        Position of n ends, x and y in turn, m; y points up.
    gravity : float
        m/s^2.
    speed_hz, mains_hz : float or None
        Of the shaft and of the hum; None for what is not fitted.
    bending_hz : sequence of float
        Of the free rotor's bending modes that spring back.
    orders_hz : sequence of float
        Of higher orders of the surface and harmonics of the hum (`tdbmon.analysis.surface_orders`).
    floor_hz : float or None
        Of a line of floor or housing (`tdbmon.analysis.floor_line`).
    variance : (2 n,) array or None
        By which the squares of each row count, m^2; None for all alike.
    sag : SpringBack or None
        How the levitated sag springs back in these rows, as far as the machine file tells it; `bending_hz` have the rest.
    """

    t: Array
    data: Array
    gravity: float
    speed_hz: float | None
    mains_hz: float | None
    bending_hz: Sequence[float] = ()
    orders_hz: Sequence[float] = ()
    floor_hz: float | None = None
    variance: Array | None = None
    sag: SpringBack | None = None

    @property
    def vertical(self) -> NDArray[np.bool_]:
        """Rows that gravity acts on."""
        return np.arange(len(self.data)) % 2 == 1

    @property
    def lasting(self) -> list[float]:
        """Frequencies that go on in the fall, Hz: hum, the surface's second and higher orders, and a line of the floor."""
        orders = [2 * self.speed_hz] if self.speed_hz else []
        return [hz for hz in (self.mains_hz, *orders, *self.orders_hz, self.floor_hz) if hz]

    @property
    def variances(self) -> Array:
        """By which the squares of each row count (2 n,)."""
        return np.ones(len(self.data)) if self.variance is None else self.variance

    def costs(self, t0: float, decay: float = 0.0, scale: float = 1.0) -> Array:
        """Sum of squares an end, in units of its variance; for readings on a `scale`."""
        return self._costs(self._laws(t0, decay), scale)

    def _costs(self, laws: _Laws, scale: float) -> Array:
        _, residual = self._fitted(laws, scale)
        rows = np.sum(residual**2, axis=1) / self.variances
        return np.asarray(rows.reshape(-1, 2).sum(axis=1))

    def cost(self, t0: float, decay: float = 0.0) -> float:
        """Sum over the ends."""
        return float(self.costs(t0, decay).sum())

    def on_any_scale(self, t0: float, reach: float) -> tuple[float, Array]:
        """Sum of squares of a sudden release, each end on the scale within reach that explains it best, and those scales.

        What is left is linear in the scale, so that three scales tell its square.
        """
        laws = self._laws(t0, 0.0)
        low, middle, high = (self._costs(laws, 1 + off) for off in (-reach, 0.0, reach))
        bend, slope = np.maximum(low - 2 * middle + high, 1e-12), (high - low) / 2
        off = np.clip(-slope / bend, -1.0, 1.0)
        return float(np.sum(middle + slope * off + bend * off**2 / 2)), 1 + reach * off

    def left_in_fall(self, end: int, t0: float, decay: float = 0.0, scale: float = 1.0) -> Array:
        """Return what a law leaves of both rows of an end after its instant, m."""
        return self.solved(t0, decay, scale)[1][2 * end : 2 * end + 2][:, self.t > t0]

    @staticmethod
    def over_noise(left: Array, white: Array, end: int) -> float:
        """Mean square of what is left of an end over the noise's, of which `white` has that of each row."""
        return float(np.mean(left**2 / white[2 * end : 2 * end + 2, None]))

    def sigma(self, t0: float, end: int | None = None) -> float:
        """Standard deviation of the instant of all ends together or of one alone, the linear part projected off."""
        h = 1e-5
        ahead, behind = self.solved(t0 + h)[1], self.solved(t0 - h)[1]
        slope = (ahead - behind) / (2 * h) / np.sqrt(self.variances)[:, None]
        rows = slice(None) if end is None else slice(2 * end, 2 * end + 2)
        return float(1 / np.sqrt(np.sum(slope[rows] ** 2)))

    @staticmethod
    def colour(residual: Array) -> float:
        """Variance inflation of a sum by autocorrelation (AR(1), mean over channels), at least one."""
        if residual.shape[1] < 4 or np.any(np.ptp(residual, axis=1) == 0):
            return 1.0
        rho = [np.corrcoef(r[1:], r[:-1])[0, 1] for r in residual]
        rho_mean = float(np.clip(np.mean(rho), 0.0, 0.95))
        return (1 + rho_mean) / (1 - rho_mean)

    def noise(self, t0: float) -> Array:
        """Standard deviation a channel of what the levitated law leaves."""
        _, residual, design = self.solved(t0)
        levitated = self.t < t0
        freedom = max(int(levitated.sum()) - design.shape[1], 4)
        return np.asarray(np.sqrt(np.sum(residual[:, levitated] ** 2, axis=1) / freedom))

    def mean_noise(self, t0: float) -> float:
        """Root of the mean square of `noise` over the channels, m; not nought."""
        return max(float(np.sqrt(np.mean(self.noise(t0) ** 2))), 1e-9)

    def place(self, t0: float) -> Array:
        """Mean levitated position a channel, m."""
        return np.asarray(self.solved(t0)[0][0])

    def whirl(self, t0: float) -> Array:
        """Acceleration of a wide levitated orbit a channel, 0-pk, m/s^2; 0 where it is narrow, or the speed is not known."""
        if not self.speed_hz:
            return np.zeros(len(self.data))
        size = np.hypot(*self.solved(t0)[0][1:3])
        return np.where(size > WIDE, (2 * np.pi * self.speed_hz) ** 2 * size, 0.0)

    def state(self, t0: float, decay: float) -> tuple[Array, Array]:
        """Position and velocity a channel at the instant, and their standard deviations: (2, 2 n) each, m and m/s.

        Hum and the shaft's surface are left out.
        """
        coefficients, residual, design = self.solved(t0, decay)
        at = np.zeros((2, design.shape[1]))
        at[0, 0] = 1.0
        if self.speed_hz:
            at[0, 1] = 1.0
            at[1, 2] = 2 * np.pi * self.speed_hz
        covariance = np.linalg.pinv(design.T @ design)
        sigma = np.sqrt(np.diag(at @ covariance @ at.T))
        noise = np.sqrt(np.mean(residual**2, axis=1) * self.colour(residual))
        return np.asarray(at @ coefficients), np.asarray(np.outer(sigma, noise))

    def solved(self, t0: float, decay: float = 0.0, scale: float = 1.0) -> tuple[Array, Array, Array]:
        """Return coefficients (p, 2 n), what is left (2 n, k) and columns (k, p) for an instant; for readings on a `scale`."""
        laws = self._laws(t0, decay)
        return *self._fitted(laws, scale), laws.design

    def _laws(self, t0: float, decay: float) -> _Laws:
        """Return what a fit to an instant needs, on whatever scale the readings are."""
        design = np.column_stack(self.levitated(t0, decay) + self.free(t0, decay))
        # normal equations: solved hundreds of times a search, and the columns are of one scale
        normal = design.T @ design
        normal += 1e-12 * np.trace(normal) * np.eye(len(normal))  # the free columns vanish for an instant at the end
        weight = self._with_rest(let_go(0j, self._rest_and_after(t0), decay).real)
        fall = np.where(self.vertical[:, None], -self.gravity * weight, 0.0) + self.sprung(t0, decay)
        return _Laws(design, normal, fall)

    def _fitted(self, laws: _Laws, scale: float) -> tuple[Array, Array]:
        """Return coefficients (p, 2 n) and what is left (2 n, k) of readings on a `scale`."""
        target = self.data - scale * laws.fall
        coefficients = np.linalg.solve(laws.normal, laws.design.T @ target.T).astype(np.float64)
        return coefficients, target - (laws.design @ coefficients).T

    def stiffer(self, factor: float) -> ReleaseFit:
        """Return the fit for a shaft whose bending frequencies are so many times as high."""
        sag = None if self.sag is None else self.sag.stiffer(factor)
        return replace(self, sag=sag, bending_hz=[factor * hz for hz in self.bending_hz])

    def sprung(self, t0: float, decay: float) -> Array:
        """Return how the sag springs back in every row (2 n, k), m, as far as the machine file tells it."""
        if self.sag is None:
            return np.zeros_like(self.data)
        return np.array([self._with_rest(row) for row in self.sag.path(self._rest_and_after(t0), decay)])

    def _rest_and_after(self, t0: float) -> Array:
        """Return 0, then the times from an instant on, counted from it, s."""
        return np.append(0.0, self.t[int(np.searchsorted(self.t, t0)) :] - t0)

    def _with_rest(self, motion: Array) -> Array:
        """Return a motion at all times, given it at those of `_rest_and_after`: before the instant it is at rest."""
        column = np.full(len(self.t), motion[0])
        column[len(column) - len(motion) + 1 :] = motion[1:]
        return column

    def levitated(self, t0: float, decay: float) -> list[Array]:
        """Columns of the levitated orbit up to t0; then position and velocity go on, and its force dies away.

        Hum, twice per revolution and higher orders are the probes' and the shaft surface's: they go on as they were.
        """
        columns = [np.ones_like(self.t)]
        if self.speed_hz:
            s, after = 2j * np.pi * self.speed_hz, self._rest_and_after(t0)[1:]
            fall = 1 + s * after
            if decay > 0:
                fall += s**2 * _path(s - 1 / decay, after)
            orbit = np.concatenate([np.exp(s * (self.t[: len(self.t) - len(after)] - t0)), fall])
            columns += [orbit.real, orbit.imag]
        for f in self.lasting:
            wave = np.exp(2j * np.pi * f * (self.t - t0))
            columns += [wave.real, wave.imag]
        return columns

    @property
    def sag_sizes(self) -> Array:
        """Standard deviation of the sag in each bending mode, m."""
        return _SAG * self.gravity / (2 * np.pi * np.array(self.bending_hz, dtype=float)) ** 2

    def free(self, t0: float, decay: float) -> list[Array]:
        """Columns of the free motion besides the fall, each starting with neither displacement nor velocity."""
        columns = []
        if self.speed_hz:
            s = 2j * np.pi * self.speed_hz
            turning = s**2 * let_go(s, self._rest_and_after(t0), decay)
            columns += [self._with_rest(turning.real), self._with_rest(turning.imag)]
        return columns + self.sags(t0, decay)

    def sags(self, t0: float, decay: float) -> list[Array]:
        """Columns of the sag that springs back in each bending mode, from 1 at rest, less that 1."""
        columns, after = [], self._rest_and_after(t0)
        for hz in self.bending_hz:
            # x'' + w^2 x = w^2 exp(-t/T)
            w = 2 * np.pi * hz
            share = (w * decay) ** 2 / (1 + (w * decay) ** 2)
            sag = (1 - share) * np.cos(w * after) - 1
            if decay > 0:
                sag += share * (np.exp(-after / decay) + np.sin(w * after) / (w * decay))
            columns.append(self._with_rest(sag))
        return columns


def _path(s: complex, after: Array) -> NDArray[np.complex128]:
    """Return the displacement by an acceleration exp(s t) from rest."""
    if s == 0:
        return np.asarray(0.5 * after**2, dtype=complex)
    return np.asarray((np.expm1(s * after) - s * after) / s**2)


def let_go(s: complex, after: Array, decay: float) -> NDArray[np.complex128]:
    """Return the displacement by an acceleration exp(s t) (1 - exp(-t / decay)) from rest: by what is held no more."""
    return _path(s, after) - _path(s - 1 / decay, after) if decay > 0 else _path(s, after)
