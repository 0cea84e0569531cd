"""Model of the motion of both ends before and after a release: the levitated orbit, and the free fall that continues it.

If the magnetic force decays as exp(-t/T) instead of vanishing at once, everything that it held is released as 1 - exp(-t/T):
weight, rotation about the inertia axis, and the sag in the lowest bending modes.  An acceleration exp(s t) from rest gives the
displacement (exp(s t) - 1 - s t) / s^2, so that the model has a closed form.  For given release instant t0 and decay time T it
is linear in its other parameters; t0 and T are found by `tdbmon.analysis.release_search`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdbmon.analysis.spring_back import SpringBack

Array = NDArray[np.float64]

WIDE = 10e-6  # m, 0-pk: orbit of a bent or badly balanced shaft, whose 1X motion goes on in the fall about as widely
_SAG = 1.0  # prior standard deviation of the sag, in gravity over the square of the mode's angular frequency


class _Laws(NamedTuple):
    """Linear model for one instant: design matrix (k, p), normal matrix (p, p), and known part of the fall, m (2 n, k)."""

    design: Array
    normal: Array
    fall: Array


@dataclass(frozen=True, eq=False)
class ReleaseFit:
    """Model of the motion before and after a release, linear in all but its instant and the force's decay time.

    Attributes
    ----------
    t : (k,) array
        Time, s, from the levitated stretch into the fall.
    data : (2 n, k) array
        Position of n ends, x and y alternating, m; y points up.
    gravity : float
        m/s^2.
    speed_hz, mains_hz : float or None
        Frequencies of rotation and of the mains hum; None for what is not fitted.
    bending_hz : sequence of float
        Frequencies of the free rotor's bending modes in which the sag relaxes.
    orders_hz : sequence of float
        Frequencies of higher run-out orders and of hum harmonics (`tdbmon.analysis.surface_orders`).
    floor_hz : float or None
        Frequency of a floor or housing vibration (`tdbmon.analysis.floor_line`).
    variance : (2 n,) array or None
        Noise variance that weights each row, m^2; None for equal weights.
    sag : SpringBack or None
        Relaxation of the levitated sag in these rows as predicted from the machine file; `bending_hz` fit what it lacks.
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
        """Mask of the rows that gravity acts on."""
        return np.arange(len(self.data)) % 2 == 1

    @property
    def lasting(self) -> list[float]:
        """Frequencies that continue during the fall, Hz: mains hum, run-out from 2X on, and floor vibration."""
        orders = [2 * self.speed_hz] if self.speed_hz else []
        return [hz for hz in (self.mains_hz, *orders, *self.orders_hz, self.floor_hz) if hz]

    @property
    def variances(self) -> Array:
        """Variances that weight the rows (2 n,), m^2; ones if not given."""
        return np.ones(len(self.data)) if self.variance is None else self.variance

    def costs(self, t0: float, decay: float = 0.0, scale: float = 1.0) -> Array:
        """Return the weighted sum of squared residuals by end; `scale` is reading over true displacement."""
        return self._costs(self._laws(t0, decay), scale)

    def _costs(self, laws: _Laws, scale: float) -> Array:
        _, residual = self._fitted(laws, scale)
        rows = np.sum(residual**2, axis=1) / self.variances
        return np.asarray(rows.reshape(-1, 2).sum(axis=1))

    def cost(self, t0: float, decay: float = 0.0) -> float:
        """Return the weighted sum of squared residuals over all ends."""
        return float(self.costs(t0, decay).sum())

    def on_any_scale(self, t0: float, reach: float) -> tuple[float, Array]:
        """Return the least cost of a sudden release with the scale of each end free within 1 ± `reach`, and those scales.

        Residuals are linear in the scale, so that the costs at three scales determine its parabola.
        """
        laws = self._laws(t0, 0.0)
        low, middle, high = (self._costs(laws, 1 + off) for off in (-reach, 0.0, reach))
        bend, slope = np.maximum(low - 2 * middle + high, 1e-12), (high - low) / 2
        off = np.clip(-slope / bend, -1.0, 1.0)
        return float(np.sum(middle + slope * off + bend * off**2 / 2)), 1 + reach * off

    def left_in_fall(self, end: int, t0: float, decay: float = 0.0, scale: float = 1.0) -> Array:
        """Return the residuals of both rows of an end after the release, m."""
        return self.solved(t0, decay, scale)[1][2 * end : 2 * end + 2][:, self.t > t0]

    @staticmethod
    def over_noise(left: Array, white: Array, end: int) -> float:
        """Return the mean square of an end's residuals `left` over the noise variance, which `white` holds for each row."""
        return float(np.mean(left**2 / white[2 * end : 2 * end + 2, None]))

    def sigma(self, t0: float, end: int | None = None) -> float:
        """Return the standard deviation of the instant, s, from all ends or one, with the linear parameters projected out."""
        h = 1e-5
        ahead, behind = self.solved(t0 + h)[1], self.solved(t0 - h)[1]
        slope = (ahead - behind) / (2 * h) / np.sqrt(self.variances)[:, None]
        rows = slice(None) if end is None else slice(2 * end, 2 * end + 2)
        return float(1 / np.sqrt(np.sum(slope[rows] ** 2)))

    @staticmethod
    def colour(residual: Array) -> float:
        """Return the variance inflation factor due to autocorrelation (AR(1), mean over channels), at least one."""
        if residual.shape[1] < 4 or np.any(np.ptp(residual, axis=1) == 0):
            return 1.0
        rho = [np.corrcoef(r[1:], r[:-1])[0, 1] for r in residual]
        rho_mean = float(np.clip(np.mean(rho), 0.0, 0.95))
        return (1 + rho_mean) / (1 - rho_mean)

    def noise(self, t0: float) -> Array:
        """Return the residual standard deviation before the instant by channel, m."""
        _, residual, design = self.solved(t0)
        levitated = self.t < t0
        freedom = max(int(levitated.sum()) - design.shape[1], 4)
        return np.asarray(np.sqrt(np.sum(residual[:, levitated] ** 2, axis=1) / freedom))

    def mean_noise(self, t0: float) -> float:
        """Return the rms of `noise` over the channels, m, at least 1 nm."""
        return max(float(np.sqrt(np.mean(self.noise(t0) ** 2))), 1e-9)

    def place(self, t0: float) -> Array:
        """Return the mean levitated position by channel, m."""
        return np.asarray(self.solved(t0)[0][0])

    def whirl(self, t0: float) -> Array:
        """Return the acceleration of a wide levitated orbit by channel, 0-pk, m/s^2; 0 if it is narrow or the speed unknown."""
        if not self.speed_hz:
            return np.zeros(len(self.data))
        size = np.hypot(*self.solved(t0)[0][1:3])
        return np.where(size > WIDE, (2 * np.pi * self.speed_hz) ** 2 * size, 0.0)

    def state(self, t0: float, decay: float) -> tuple[Array, Array]:
        """Return position and velocity by channel at the instant, and their standard deviations: (2, 2 n) each, m and m/s.

        Hum and run-out are excluded.
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
        """Return coefficients (p, 2 n), residuals (2 n, k) and design matrix (k, p) for an instant; `scale` as in `costs`."""
        laws = self._laws(t0, decay)
        return *self._fitted(laws, scale), laws.design

    def _laws(self, t0: float, decay: float) -> _Laws:
        """Return the linear model for one instant, which does not depend on the scale of the readings."""
        design = np.column_stack(self.levitated(t0, decay) + self.free(t0, decay))
        # normal equations: solved hundreds of times per search, and the columns are of similar magnitude
        normal = design.T @ design
        normal += 1e-12 * np.trace(normal) * np.eye(len(normal))  # the free columns vanish for an instant at the end
        weight = self._with_rest(let_go(0j, self._rest_and_after(t0), decay).real)
        fall = np.where(self.vertical[:, None], -self.gravity * weight, 0.0) + self.sprung(t0, decay)
        return _Laws(design, normal, fall)

    def _fitted(self, laws: _Laws, scale: float) -> tuple[Array, Array]:
        """Return coefficients (p, 2 n) and residuals (2 n, k); `scale` as in `costs`."""
        target = self.data - scale * laws.fall
        coefficients = np.linalg.solve(laws.normal, laws.design.T @ target.T).astype(np.float64)
        return coefficients, target - (laws.design @ coefficients).T

    def stiffer(self, factor: float) -> ReleaseFit:
        """Return the fit for a shaft whose bending frequencies are multiplied by a factor."""
        sag = None if self.sag is None else self.sag.stiffer(factor)
        return replace(self, sag=sag, bending_hz=[factor * hz for hz in self.bending_hz])

    def sprung(self, t0: float, decay: float) -> Array:
        """Return the relaxation of the sag in every row (2 n, k), m, as predicted from the machine file; 0 without that."""
        if self.sag is None:
            return np.zeros_like(self.data)
        return np.array([self._with_rest(row) for row in self.sag.path(self._rest_and_after(t0), decay)])

    def _rest_and_after(self, t0: float) -> Array:
        """Return 0, followed by the sample times from an instant on, relative to it, s."""
        return np.append(0.0, self.t[int(np.searchsorted(self.t, t0)) :] - t0)

    def _with_rest(self, motion: Array) -> Array:
        """Extend a motion, given at the times of `_rest_and_after`, to all times: before the instant it is at rest."""
        column = np.full(len(self.t), motion[0])
        column[len(column) - len(motion) + 1 :] = motion[1:]
        return column

    def levitated(self, t0: float, decay: float) -> list[Array]:
        """Return the columns of the levitated orbit up to t0, continued with its position and velocity while its force decays.

        Hum, 2X and higher orders come from the wiring and the shaft surface: they continue unchanged.
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
        """Prior standard deviation of the sag in each bending mode, m."""
        return _SAG * self.gravity / (2 * np.pi * np.array(self.bending_hz, dtype=float)) ** 2

    def free(self, t0: float, decay: float) -> list[Array]:
        """Return the columns of the free motion besides the fall, each with zero initial displacement and velocity."""
        columns = []
        if self.speed_hz:
            s = 2j * np.pi * self.speed_hz
            turning = s**2 * let_go(s, self._rest_and_after(t0), decay)
            columns += [self._with_rest(turning.real), self._with_rest(turning.imag)]
        return columns + self.sags(t0, decay)

    def sags(self, t0: float, decay: float) -> list[Array]:
        """Return the columns of the sag's relaxation in each bending mode: change from a unit sag at rest."""
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
    """Return the displacement due to an acceleration exp(s t) from rest."""
    if s == 0:
        return np.asarray(0.5 * after**2, dtype=complex)
    return np.asarray((np.expm1(s * after) - s * after) / s**2)


def let_go(s: complex, after: Array, decay: float) -> NDArray[np.complex128]:
    """Return the displacement due to an acceleration exp(s t) (1 - exp(-t / decay)) from rest: that of a decaying restraint."""
    return _path(s, after) - _path(s - 1 / decay, after) if decay > 0 else _path(s, after)
