"""The laws before and after a release, fitted to both ends: the orbit in levitation, and the fall that grows out of it.

Where the magnetic force dies away as exp(-t/T) instead of at once, what it held is let go as 1 - exp(-t/T): weight, the
turning of the shaft about its inertia axis, and the sag in the lowest bending modes alike.  An acceleration exp(s t) from rest
is the path (exp(s t) - 1 - s t) / s^2, so all of it is closed.  With the instant t0 and T given, the rest is linear.

A probe that errs at one end must not date the release: each end counts by what its own best law leaves in the fall, the
instants of the ends alone widen the interval where they disagree (R. T. Birge, Phys. Rev. 40 (1932) 207), and a soft
start is believed only where no end alone speaks against it.  Between a sudden and a soft start that explain the fall about as
well the interval holds both.  A fall that probes show on a scale a few per cent off looks like a soft start too: what a sudden
release on a scale within their tolerance explains about as well is no sure decay.  Further off the two part: what a sudden
release on a scale of its own explains better than any decay, leaving noise alone, is a wrong sensitivity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tdbmon.estimate import Z95

Array = NDArray[np.float64]

_MODEL_S = 12e-6  # what higher bending modes leave: the error's rms on synthetic drops with a known release
_ALONE_S = 25e-6  # the same of one end alone: two ends' errors largely cancel
_SOFT_MODEL = 0.03  # of the decay time: the levitation's stiffness, which decays too, is left out
_SOFT_S = 6e-5  # of the decay time and, against it, of the instant: what modes that are left out do to a short decay
_WITHIN = 3.84  # of a chi-square of one degree of freedom, 95 %
_SURE = 36.0  # improvement of the misfit (chi-square) from which on a soft start is believed
_DOUBT = 12.0  # from which on it is held possible
_AGAINST = 10.0  # by which an end alone, released suddenly at an instant of its own, may be better explained
PROBE_SCALE = 0.05  # of a reading: by so much the scale of an eddy-current probe may be off (API Standard 670)
_BEYOND, _ANY_SCALE = 0.075, 0.5  # the same, of a sensitivity that is wrong: surely beyond the tolerance, and at most
_NOISE_ALONE = 2.0  # times the noise's mean square: at most left in the fall where scales explain it
_MISREAD = 50.0  # improvement of the misfit by such a scale that sound records do not show
_STEP_S = 2.5e-4  # of the first search
_NEAR_S = 3e-3  # of the first search's instant: where the later ones look
_LEAST_DECAY_S = 1e-4
WIDE = 10e-6  # m, 0-pk: an orbit of a bent or badly balanced shaft, which turns on in the fall about as widely
_SAG = 1.0  # of gravity over the square of a bending mode's angular frequency, standard deviation: the sag that springs back
_MIMICKED_S = 5e-4  # a shorter decay may be bending that is left out: not reported unless sure


@dataclass(frozen=True)
class FittedRelease:
    """Instant and its 95 % interval, s; decay time with its limits, s, where the fall may start soft.

    `misread` is the decay time, s, that a sudden release on a scale within the probes' tolerance explains about as well; else 0.
    `scales` says how many times too long each end reads, where a sudden release explains the fall on these alone; else empty.
    """

    time: float
    low: float
    high: float
    decay: tuple[float, float, float] | None
    misread: float = 0.0
    scales: tuple[float, ...] = ()


class _Laws(NamedTuple):
    """What a fit to an instant needs: columns (k, p), normal matrix (p, p), and the path of a unit weight let go there (k,)."""

    design: Array
    normal: Array
    let_go: Array


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
    def _variances(self) -> Array:
        return np.ones(len(self.data)) if self.variance is None else self.variance

    def search(self, low: float, high: float) -> FittedRelease:
        """Find the release between two instants."""
        rough = self._sudden_together(low, high)
        near = rough - _NEAR_S, rough + _NEAR_S
        best, alone = self._by_noise(rough)._sudden(*near)
        white = self._by_noise(best)
        t0, decay = white._soft(best)
        if decay > _LEAST_DECAY_S and white.cost(best) - white.cost(t0, decay) > _DOUBT:
            gentle = [white._soft(instant, end) for end, instant in enumerate(alone)]
            soft = white._by_what_is_left(gentle)._softly(near)
            if soft is not None:
                return soft
        return white._by_what_is_left([(instant, 0.0) for instant in alone])._suddenly(near)

    def _by_noise(self, t0: float) -> ReleaseFit:
        """Return it with each row counted by the noise that the levitated law leaves before an instant."""
        return replace(self, variance=np.maximum(self.noise(t0) ** 2, 1e-18))

    def _by_what_is_left(self, laws: Sequence[tuple[float, float]]) -> ReleaseFit:
        """Return it with each end counted by what its own law (t0, T) leaves in the fall."""
        return replace(self, variance=self._variances * self._excess(laws, self._variances))

    def _softly(self, near: tuple[float, float]) -> FittedRelease | None:
        """Return the release about some instants as one of a force that dies away; None where it is not plainly that."""
        best, alone = self._sudden(*near)
        t0, decay = self._soft(best)
        gain = self.cost(best) - self.cost(t0, decay)
        apart = self._apart(alone)
        each = apart - self.costs(t0, decay)
        if decay <= _LEAST_DECAY_S or gain <= _DOUBT or np.any(each <= -_AGAINST):
            return None
        soft = self._profile(t0, decay)
        if gain <= _SURE:
            return self._either(best, soft)
        scaled = self._sudden_on_any_scale(best, t0)
        within = self._on_any_scale(scaled)[0]
        misscaled = self._misscaled(min(self.cost(t0, decay), apart.sum(), within) - _DOUBT, best, t0)
        if misscaled is not None:
            return misscaled
        soft = self._with_scale(soft)
        if within - self.cost(t0, decay) < _SURE:
            return replace(self._either(scaled, soft), misread=decay)
        return soft

    def _suddenly(self, near: tuple[float, float]) -> FittedRelease:
        """Return the release about some instants as a sudden one."""
        best, alone = self._sudden(*near)
        scaled = self._sudden_on_any_scale(best)
        within = self._on_any_scale(scaled)[0]
        least = min(self.cost(best) - _MISREAD, self._apart(alone).sum() - _DOUBT, within - _DOUBT)
        misscaled = self._misscaled(least, best)
        if misscaled is not None:
            return misscaled
        errors = [np.hypot(self._sigma(best, end), _MODEL_S) for end in range(len(alone))]
        scatter = float(np.sum(((np.array(alone) - best) / errors) ** 2)) / max(1, len(alone) - 1)
        half = Z95 * float(np.hypot(self._sigma(best), self._model) * np.sqrt(max(1.0, scatter)))
        low, high = best - half, best + half
        if self.cost(best) - within > _MISREAD:
            low, high = min(low, scaled - half), max(high, scaled + half)
        return FittedRelease(best, low, high, None)

    @property
    def _model(self) -> float:
        """What higher bending modes leave, s."""
        return _MODEL_S if len(self.data) > 2 else _ALONE_S

    def _with_scale(self, soft: FittedRelease) -> FittedRelease:
        """Widen the ranges of instant and decay time by what a scale at the limits of the probes' tolerance makes of them."""
        if soft.decay is None:
            return soft
        decay, shortest, longest = soft.decay
        instants, decays = zip(
            *(self._soft(soft.time, scale=1 + off) for off in (-PROBE_SCALE, PROBE_SCALE)), strict=True
        )
        low, high = _widened(soft.time, soft.low, soft.high, instants)
        shortest, longest = _widened(decay, shortest, longest, decays)
        return replace(soft, low=low, high=high, decay=(decay, max(0.0, shortest), longest))

    def _either(self, sudden: float, soft: FittedRelease) -> FittedRelease:
        """Return a sudden release, which is the usual one, with an interval that holds the soft one too."""
        half = Z95 * float(np.hypot(self._sigma(sudden), self._model))
        decay = None
        if soft.decay is not None and soft.decay[1] > _MIMICKED_S:
            decay = (soft.decay[0], 0.0, soft.decay[2])
        return FittedRelease(sudden, min(soft.low, sudden - half), max(soft.high, sudden + half), decay)

    def costs(self, t0: float, decay: float = 0.0, scale: float = 1.0) -> Array:
        """Sum of squares an end, in units of its variance; for readings on a `scale`."""
        return self._costs(self._laws(t0, decay), scale)

    def _costs(self, laws: _Laws, scale: float) -> Array:
        _, residual = self._fitted(laws, scale)
        rows = np.sum(residual**2, axis=1) / self._variances
        return np.asarray(rows.reshape(-1, 2).sum(axis=1))

    def _apart(self, alone: Sequence[float]) -> Array:
        """Sum of squares of each end, released suddenly at an instant of its own."""
        return np.array([self.costs(instant)[end] for end, instant in enumerate(alone)])

    def cost(self, t0: float, decay: float = 0.0) -> float:
        """Sum over the ends."""
        return float(self.costs(t0, decay).sum())

    def _sudden(self, low: float, high: float) -> tuple[float, list[float]]:
        """Return the instant of a sudden release, of all ends together and of each alone."""
        grid, costs = self._coarsely(low, high)
        ends = range(costs.shape[1])
        return self._least(grid, costs, [*ends]), [self._least(grid, costs, [end]) for end in ends]

    def _sudden_together(self, low: float, high: float) -> float:
        """Return the instant of a sudden release of all ends together."""
        grid, costs = self._coarsely(low, high)
        return self._least(grid, costs, [*range(costs.shape[1])])

    def _coarsely(self, low: float, high: float) -> tuple[Array, Array]:
        """Return instants (m,) in coarse steps, s, and what a sudden release at each leaves of every end (m, n)."""
        grid = np.arange(max(low, self.t[0] + 4e-3), min(high, self.t[-1] - 5e-4), _STEP_S)
        return grid, np.array([self.costs(t0) for t0 in grid])

    def _least(self, grid: Array, costs: Array, which: list[int]) -> float:
        """Return the instant near the best of some, at which a sudden release leaves the least of some ends, s."""
        from scipy.optimize import minimize_scalar

        centre = grid[int(np.argmin(costs[:, which].sum(axis=1)))]
        span, exact = (centre - _STEP_S, centre + _STEP_S), {"xatol": 1e-7}
        best = minimize_scalar(
            lambda t0: float(self.costs(t0)[which].sum()), bounds=span, method="bounded", options=exact
        )
        return float(best.x)

    def _on_any_scale(self, t0: float, reach: float = PROBE_SCALE) -> tuple[float, Array]:
        """Sum of squares of a sudden release, each end on the scale within reach that explains it best, and those scales.

        What is left is linear in the scale, so that three scales tell its square.
        """
        laws = self._laws(t0, 0.0)
        low, middle, high = (self._costs(laws, 1 + off) for off in (-reach, 0.0, reach))
        bend, slope = np.maximum(low - 2 * middle + high, 1e-12), (high - low) / 2
        off = np.clip(-slope / bend, -1.0, 1.0)
        return float(np.sum(middle + slope * off + bend * off**2 / 2)), 1 + reach * off

    def _sudden_on_any_scale(self, *near: float, reach: float = PROBE_SCALE) -> float:
        from scipy.optimize import minimize_scalar

        def left(instant: float) -> float:
            return self._on_any_scale(instant, reach)[0]

        grid = np.arange(min(near) - 1e-3, max(near) + 1e-3, _STEP_S / 2)
        rough = float(min(grid, key=left))
        span = (rough - _STEP_S / 2, rough + _STEP_S / 2)
        return float(minimize_scalar(left, bounds=span, method="bounded", options={"xatol": 1e-7}).x)

    def _misscaled(self, least: float, *near: float) -> FittedRelease | None:
        """Return a sudden release on scales beyond the probes' tolerance that leave less than `least`; None where none does."""
        found = self._sudden_on_any_scale(*near, reach=_ANY_SCALE)
        left, scales = self._on_any_scale(found, _ANY_SCALE)
        beyond = bool(np.any(np.abs(scales - 1) > _BEYOND))
        if not beyond or left > least or not self._noise_alone(found, scales):
            return None
        about = found + np.arange(-1e-3, 1e-3, _STEP_S / 10)
        also = about[[self._on_any_scale(instant, _ANY_SCALE)[0] - left <= _WITHIN for instant in about]]
        model = Z95 * _ALONE_S
        return FittedRelease(
            found, float(also.min()) - model, float(also.max()) + model, None, scales=tuple(scales.tolist())
        )

    def _noise_alone(self, t0: float, scales: Array) -> bool:
        """Whether a sudden release on such scales leaves about what noise would in the fall: a late channel leaves more."""
        white = self.noise(t0) ** 2
        return all(
            self._over_noise(self._left_in_fall(end, t0, scale=float(scale)), white, end) <= _NOISE_ALONE
            for end, scale in enumerate(scales)
        )

    def _soft(self, start: float, end: int | None = None, scale: float = 1.0) -> tuple[float, float]:
        """Return instant and decay time of a soft release, of all ends together or of one alone; for readings on a `scale`."""
        from scipy.optimize import minimize

        def misfit(point: Array) -> float:
            costs = self.costs(point[0] * 1e-3, abs(point[1]) * 1e-3, scale)
            return float(costs.sum() if end is None else costs[end])

        options = {"xatol": 1e-3, "fatol": 0.05}
        found = minimize(misfit, [start * 1e3 - 0.5, 1.0], method="Nelder-Mead", options=options)
        return float(found.x[0]) * 1e-3, abs(float(found.x[1])) * 1e-3

    def _excess(self, laws: Sequence[tuple[float, float]], white: Array) -> Array:
        """Return by how much the variance of each row exceeds the noise in the fall, for the law (t0, T) of each end.

        Mean square of what is left over that of the noise, at least one, times what autocorrelation inflates a sum by.
        """
        factors = []
        for end, (t0, decay) in enumerate(laws):
            left = self._left_in_fall(end, t0, decay)
            factors.append(max(1.0, self._over_noise(left, white, end)) * self.colour(left))
        return np.repeat(factors, 2)

    def _left_in_fall(self, end: int, t0: float, decay: float = 0.0, scale: float = 1.0) -> Array:
        """Return what a law leaves of both rows of an end after its instant, m."""
        return self.solved(t0, decay, scale)[1][2 * end : 2 * end + 2][:, self.t > t0]

    @staticmethod
    def _over_noise(left: Array, white: Array, end: int) -> float:
        """Mean square of what is left of an end over the noise's, of which `white` has that of each row."""
        return float(np.mean(left**2 / white[2 * end : 2 * end + 2, None]))

    def _profile(self, t0: float, decay: float) -> FittedRelease:
        """Ranges of instant and decay time in which the cost stays near its least: the two are far from linear."""
        from scipy.optimize import minimize_scalar

        decays = np.concatenate([[decay], decay * np.geomspace(0.1, 5.0, 41)])
        span = (t0 - 2e-3, t0 + 2e-3)
        found = [
            minimize_scalar(lambda t, d=d: self.cost(t, d), bounds=span, method="bounded", options={"xatol": 1e-6})
            for d in decays
        ]
        costs, instants = np.array([f.fun for f in found]), np.array([f.x for f in found])
        near = costs - costs.min() <= _WITHIN
        value, best = float(instants[int(np.argmin(costs))]), float(decays[int(np.argmin(costs))])
        reach = max(value - instants[near].min(), instants[near].max() - value) + Z95 * self._sigma(t0)
        half = float(np.hypot(reach, Z95 * np.hypot(_SOFT_S, _SOFT_MODEL * best)))
        wider = Z95 * float(np.hypot(_SOFT_S, _SOFT_MODEL * best))
        low, high = best - np.hypot(best - decays[near].min(), wider), best + np.hypot(decays[near].max() - best, wider)
        return FittedRelease(value, value - half, value + half, (best, max(0.0, float(low)), float(high)))

    def _sigma(self, t0: float, end: int | None = None) -> float:
        """Standard deviation of the instant of all ends together or of one alone, the linear part projected off."""
        h = 1e-5
        ahead, behind = self.solved(t0 + h)[1], self.solved(t0 - h)[1]
        slope = (ahead - behind) / (2 * h) / np.sqrt(self._variances)[:, None]
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

    def place(self, t0: float) -> Array:
        """Mean levitated position a channel, m."""
        return np.asarray(self.solved(t0)[0][0])

    def whirl(self, t0: float) -> Array:
        """Acceleration of a wide levitated orbit a channel, 0-pk, m/s^2; 0 where it is narrow, or the speed is not known."""
        if not self.speed_hz:
            return np.zeros(len(self.data))
        size = np.hypot(*self.solved(t0)[0][1:3])
        return np.where(size > WIDE, (2 * np.pi * self.speed_hz) ** 2 * size, 0.0)

    def state(self, t0: float, decay: float = 0.0) -> tuple[Array, Array]:
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
        return _Laws(design, normal, self._with_rest(let_go(0j, self._rest_and_after(t0), decay).real))

    def _fitted(self, laws: _Laws, scale: float) -> tuple[Array, Array]:
        """Return coefficients (p, 2 n) and what is left (2 n, k) of readings on a `scale`."""
        target = self.data - np.where(self.vertical[:, None], -scale * self.gravity * laws.let_go, 0.0)
        coefficients = np.linalg.solve(laws.normal, laws.design.T @ target.T).astype(np.float64)
        return coefficients, target - (laws.design @ coefficients).T

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


def _widened(value: float, low: float, high: float, others: Sequence[float]) -> tuple[float, float]:
    """Return an interval widened, as by an independent error, to what the value would be otherwise."""
    down, up = max(0.0, value - min(others)), max(0.0, max(others) - value)
    return value - float(np.hypot(value - low, down)), value + float(np.hypot(high - value, up))


def _path(s: complex, after: Array) -> NDArray[np.complex128]:
    """Return the displacement by an acceleration exp(s t) from rest."""
    if s == 0:
        return np.asarray(0.5 * after**2, dtype=complex)
    return np.asarray((np.expm1(s * after) - s * after) / s**2)


def let_go(s: complex, after: Array, decay: float) -> NDArray[np.complex128]:
    """Return the displacement by an acceleration exp(s t) (1 - exp(-t / decay)) from rest: by what is held no more."""
    return _path(s, after) - _path(s - 1 / decay, after) if decay > 0 else _path(s, after)
