"""The instant at which the magnetic field let go, found in the record itself.

Before it the shaft stands in its levitated orbit: a constant, once and twice per revolution and the mains.  After it the
rotor falls freely: a parabola under gravity, once per revolution about its inertia axis, and the sag between the magnetic
bearings springs back in the first bending mode.  Position and velocity do not jump.  Where the magnetic force dies away
with a time constant T instead of at once, the fall is g (t^2/2 - T t + T^2 (1 - exp(-t/T))): it starts late and soft.
With the instant (and T) given, everything else is linear, so these alone are searched, on both ends at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.estimate import Estimate

_MODEL_S = 12e-6  # what higher bending modes leave: the error's rms on synthetic drops with a known release
_SOFT_MODEL = 0.1  # of the decay time: the levitation's stiffness and whirl forces, which decay too, are left out
_SURE = 12.0  # improvement of the misfit (chi-square) from which on a soft start is believed
_FALL_SHARE = 0.6  # of the way from levitation to the first turning point: surely free of contact


@dataclass(frozen=True)
class EndState:
    """Position and velocity of the shaft centre of one end at the release (SI)."""

    x: Estimate
    y: Estimate
    vx: Estimate
    vy: Estimate


@dataclass(frozen=True)
class Release:
    """The release of a drop.

    Attributes
    ----------
    time : Estimate
        From the record's first sample, s.
    states : dict
        Position and velocity an end.
    noise : dict
        Standard deviation, m, of what remains of the levitated orbit an end (mean of both axes).
    levitated : dict
        Mean levitated position (x, y) an end, m.
    fall : dict
        Acceleration (x, y) fitted to the free fall an end, m/s^2: a check on units and directions.
    force_decay : Estimate
        Time constant T of the magnetic force after the switch-off; missing where the force vanished at once.
    """

    time: Estimate
    force_decay: Estimate
    states: dict[str, EndState]
    noise: dict[str, float]
    levitated: dict[str, tuple[float, float]]
    fall: dict[str, tuple[float, float]]


def find_release(
    planes: xr.Dataset, machine: Machine, speed_hz: float | None, bending_hz: float | None = None
) -> Release | None:
    """Find the release.

    Parameters
    ----------
    planes : Dataset
        Result of `to_planes`.
    machine : Machine
        For gravity and the mains frequency.
    speed_hz : float or None
        Rotor speed before the release; None where it is not known (then no once-per-revolution term is fitted).
    bending_hz : float, optional
        First free-free bending frequency of the rotor, in which the levitated sag springs back.

    Returns
    -------
    Release or None
        None where the record starts after the release (no levitated stretch of 20 ms).

    Raises
    ------
    InputError
        If the rotor never leaves its levitated position.
    """
    ends = [str(end) for end in planes.end.values if str(planes.plane.sel(end=end).item()) != "none"]
    z = planes.displacement.sel(end=ends).to_numpy().reshape(2 * len(ends), -1)
    time, rate = planes.time.to_numpy(), planes.attrs["sampling_hz"]
    rough = _rough(z, rate)
    if rough is None:
        return None
    start, stop = rough
    first = max(0, start - int(0.2 * rate))
    window = slice(first, stop)
    t, data = time[window], z[:, window]
    valid = np.isfinite(data).all(axis=0)
    t, data = t[valid], data[:, valid]
    frequencies = [machine.mains] if start - first > rate / machine.mains else []
    if speed_hz:
        frequencies += [speed_hz, 2 * speed_hz]
    fit = _Fit(t, data, machine.gravity, frequencies, speed_hz, bending_hz)
    best, soft = fit.search(time[start] - 0.012, time[start] + 0.004)
    states, noise, levitated, fall = {}, {}, {}, {}
    position, velocity, spread = fit.state(best[0])
    remains = fit.noise(best[0])
    acceleration = fit.acceleration(best[0])
    for i, end in enumerate(ends):
        rows = (2 * i, 2 * i + 1)
        values = [position[rows[0]], position[rows[1]], velocity[rows[0]], velocity[rows[1]]]
        errors = [spread[0][rows[0]], spread[0][rows[1]], spread[1][rows[0]], spread[1][rows[1]]]
        units = ("um", "um", "mm/s", "mm/s")
        made = [
            Estimate.from_sigma(v, s, u, "levitated orbit continued to the release")
            for v, s, u in zip(values, errors, units, strict=True)
        ]
        states[end] = EndState(*made)
        noise[end] = float(np.sqrt(np.mean(remains[list(rows)] ** 2)))
        levitated[end] = (float(fit.mean[rows[0]]), float(fit.mean[rows[1]]))
        fall[end] = (float(acceleration[rows[0]]), float(acceleration[rows[1]]))
    when = Estimate.from_sigma(*best, "s", "levitated orbit and free fall joined without a jump, both ends")
    if soft is None:
        decay = Estimate.missing("ms", "the fall starts at once; no decaying magnetic force is seen")
    else:
        decay = Estimate(*soft, "ms", "exponential decay of the holding force, profile of the misfit")
    return Release(when, decay, states, noise, levitated, fall)


def _rough(z: np.ndarray, rate: float) -> tuple[int, int] | None:
    """Return the sample at which the shaft leaves its orbit and the one that ends the surely free fall."""
    lead = max(int(0.02 * rate), 8)
    if z.shape[1] < 3 * lead:
        raise InputError(f"the displacement record has {z.shape[1]} samples; too short to hold a drop")
    head = z[:, :lead]
    middle = np.nanmedian(head, axis=1)
    away = np.abs(z - middle[:, None])
    orbit = np.nanmax(away[:, :lead], axis=1)
    reach = np.nanmax(away, axis=1)
    if not np.any(reach > np.maximum(8 * orbit, 20e-6)):
        if np.any(orbit > 20e-6):
            return None  # it moves from the first sample on: the record starts after the release
        raise InputError(
            f"the rotor never leaves its levitated position by more than {np.nanmax(reach) * 1e6:.1f} um;"
            " no drop is in this record"
        )
    free = np.inf
    stop = 0
    for row in range(z.shape[0]):
        if reach[row] <= max(8 * orbit[row], 20e-6):
            continue
        threshold = max(3 * orbit[row], 3e-6)
        outside = away[row] > threshold
        run = max(int(0.002 * rate), 4)
        sustained = np.convolve(outside, np.ones(run), "valid") >= run
        if not sustained.any():
            continue
        left = int(np.argmax(sustained))
        if left < free:
            free = left
            tail = away[row, left : left + max(int(0.05 * rate), 8)]
            rising = np.flatnonzero(tail[1:] < tail[:-1] - 2e-6)
            smooth = np.convolve(tail, np.ones(5) / 5, "same")
            turn = int(np.argmax(np.diff(smooth[3:]) < 0)) + 3 if rising.size else tail.size - 1
            stop = left + int(np.argmax(tail > _FALL_SHARE * tail[: turn + 1].max()))
    if not np.isfinite(free) or free < lead:
        return None
    return int(free), max(stop, int(free) + 4)


class _Fit:
    """The two laws, joined at an instant t0; linear in all but t0 and the force's decay time."""

    def __init__(
        self,
        t: np.ndarray,
        data: np.ndarray,
        gravity: float,
        frequencies: list[float],
        speed_hz: float | None,
        bending_hz: float | None,
    ) -> None:
        self.t, self.data = t, data
        self.gravity = gravity
        self.frequencies = frequencies
        self.speed_hz, self.bending_hz = speed_hz, bending_hz
        self.mean = np.zeros(data.shape[0])
        self.vertical = np.arange(data.shape[0]) % 2 == 1
        self.variance = np.ones(data.shape[0])

    def _levitated(self, t0: float) -> list[np.ndarray]:
        """Columns of the levitated orbit up to t0, then its tangent: position and velocity go on, the force does not."""
        after, before = np.maximum(self.t - t0, 0.0), np.minimum(self.t - t0, 0.0)
        columns = [np.ones_like(self.t)]
        for f in self.frequencies:
            w = 2 * np.pi * f
            columns += [np.cos(w * before), np.sin(w * before) + w * after]
        return columns

    def _free(self, t0: float) -> list[np.ndarray]:
        """Columns of the free motion besides the fall, each starting with neither displacement nor velocity."""
        after = np.maximum(self.t - t0, 0.0)
        columns = []
        if self.speed_hz:
            w = 2 * np.pi * self.speed_hz
            columns += [np.cos(w * after) - 1, np.sin(w * after) - w * after]
        if self.bending_hz:
            columns.append(np.cos(2 * np.pi * self.bending_hz * after) - 1)
        return columns

    def _fall(self, t0: float, decay: float) -> np.ndarray:
        after = np.maximum(self.t - t0, 0.0)
        path = 0.5 * after**2
        if decay > 0:
            path = path - decay * after + decay**2 * -np.expm1(-after / decay)
        return -self.gravity * path

    def _solve(self, t0: float, decay: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        design = np.column_stack(self._levitated(t0) + self._free(t0))
        target = self.data - np.where(self.vertical[:, None], self._fall(t0, decay), 0.0)
        # normal equations: solved hundreds of times a search, and the columns are of one scale
        normal = design.T @ design
        normal += 1e-12 * np.trace(normal) * np.eye(len(normal))  # the free columns vanish for an instant at the end
        coefficients = np.linalg.solve(normal, design.T @ target.T)
        return coefficients, target - (design @ coefficients).T, design

    def cost(self, t0: float, decay: float = 0.0) -> float:
        """Sum of squares in units of each channel's noise."""
        _, residual, _ = self._solve(t0, decay)
        return float(np.sum(np.sum(residual**2, axis=1) / self.variance))

    def search(self, low: float, high: float) -> tuple[tuple[float, float], tuple[float, float, float] | None]:
        """Return (instant, its standard deviation) and, where the fall starts soft, (decay time, low, high)."""
        from scipy.optimize import minimize, minimize_scalar

        step = 2.5e-4
        for _ in range(2):
            grid = np.arange(max(low, self.t[0] + 4e-3), min(high, self.t[-1] - 5e-4), step)
            centre = grid[int(np.argmin([self.cost(t0) for t0 in grid]))]
            found = minimize_scalar(self.cost, bounds=(centre - step, centre + step), method="bounded")
            best = float(found.x)
            self.variance = np.maximum(self.noise(best) ** 2, 1e-18)
        coefficients, residual, _ = self._solve(best)
        self.mean = coefficients[0]
        freedom = self.data.size - coefficients.size - 1
        inflation = self._colour(residual) * max(1.0, self.cost(best) / freedom)
        gentle = minimize(
            lambda p: self.cost(p[0] * 1e-3, abs(p[1]) * 1e-3),
            [best * 1e3 - 0.5, 1.0],
            method="Nelder-Mead",
            options={"xatol": 1e-3, "fatol": 0.05},
        )
        t0, decay = float(gentle.x[0]) * 1e-3, abs(float(gentle.x[1])) * 1e-3
        if self.cost(best) - gentle.fun > _SURE * inflation and decay > 1e-4:
            self.variance = np.maximum(self.noise(t0) ** 2, 1e-18)
            inflation = self._colour(residual) * max(1.0, self.cost(t0, decay) / freedom)
            return self._profile(t0, decay, inflation)
        return (best, float(np.hypot(self._sigma(best) * np.sqrt(inflation), _MODEL_S))), None

    def _profile(
        self, t0: float, decay: float, inflation: float
    ) -> tuple[tuple[float, float], tuple[float, float, float]]:
        """Ranges of instant and decay time in which the cost stays near its least: the two are far from linear."""
        from scipy.optimize import minimize_scalar

        decays = np.concatenate([[decay], decay * np.geomspace(0.1, 5.0, 41)])
        span = 2e-3
        found = [
            minimize_scalar(
                lambda t, d=d: self.cost(t, d), bounds=(t0 - span, t0 + span), method="bounded", options={"xatol": 1e-6}
            )
            for d in decays
        ]
        costs, instants = np.array([f.fun for f in found]), np.array([f.x for f in found])
        near = costs - costs.min() <= 3.84 * inflation
        conditional = 1.96 * self._sigma(t0) * np.sqrt(inflation)
        value = float(instants[int(np.argmin(costs))])
        reach = max(value - instants[near].min(), instants[near].max() - value)
        best = float(decays[int(np.argmin(costs))])
        half = float(np.hypot(reach + conditional, 1.96 * np.hypot(_MODEL_S, _SOFT_MODEL * best)))
        low, high = float(decays[near].min()), float(decays[near].max())
        return (value, half / 1.96), (best, low * (1 - 2 * _SOFT_MODEL), high * (1 + 2 * _SOFT_MODEL))

    def _sigma(self, t0: float) -> float:
        """Standard deviation of the instant for white noise, the linear part projected off."""
        h = 1e-5
        ahead, behind = self._solve(t0 + h)[1], self._solve(t0 - h)[1]
        slope = (ahead - behind) / (2 * h) / np.sqrt(self.variance)[:, None]
        return float(1 / np.sqrt(np.sum(slope**2)))

    def _colour(self, residual: np.ndarray) -> float:
        """Variance inflation of a sum by autocorrelation (AR(1), mean over channels), at least one."""
        rho = [np.corrcoef(r[1:], r[:-1])[0, 1] for r in residual]
        rho_mean = float(np.clip(np.mean(rho), 0.0, 0.95))
        return (1 + rho_mean) / (1 - rho_mean)

    def noise(self, t0: float) -> np.ndarray:
        """Standard deviation a channel of what the levitated law leaves."""
        _, residual, design = self._solve(t0)
        levitated = self.t < t0
        freedom = max(int(levitated.sum()) - design.shape[1], 4)
        return np.sqrt(np.sum(residual[:, levitated] ** 2, axis=1) / freedom)

    def state(self, t0: float) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Position and velocity a channel at the instant, and their standard deviations."""
        coefficients, residual, design = self._solve(t0)
        at = np.zeros((2, design.shape[1]))
        at[0, 0] = 1.0
        for i, f in enumerate(self.frequencies):
            at[0, 1 + 2 * i] = 1.0
            at[1, 2 + 2 * i] = 2 * np.pi * f
        covariance = np.linalg.pinv(design.T @ design)
        sigma = np.sqrt(np.diag(at @ covariance @ at.T))
        noise = np.sqrt(np.mean(residual**2, axis=1) * self._colour(residual))
        value = at @ coefficients
        return value[0], value[1], (sigma[0] * noise, sigma[1] * noise)

    def acceleration(self, t0: float) -> np.ndarray:
        """Acceleration a channel after the instant when it is left free, m/s^2."""
        after = np.maximum(self.t - t0, 0.0)
        design = np.column_stack([*self._levitated(t0), 0.5 * after**2])
        coefficients, *_ = np.linalg.lstsq(design, self.data.T, rcond=None)
        return np.asarray(coefficients[-1])
