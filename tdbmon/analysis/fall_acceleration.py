"""Acceleration fitted to the free fall: that of gravity, if the scales of length and time are right."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.release_fit import WIDE, Array, ReleaseFit, let_go

_ANEW_S, _STEP_S = 8e-3, 2.5e-4  # search range of the instant about the given release, and its step
_GOES_ON = 0.5  # prior standard deviation per axis of the 1X motion in the fall, relative to the levitated orbit
_LEAST_ORBIT = 3e-7  # m: the least value of that standard deviation
_BENDING = 0.05  # relative standard deviation of a model's bending frequency
_QUICK_HZ = 500.0  # modes above do not resemble gravity in a fall of some milliseconds
_HELD = 0.2  # factor on the prior standard deviation of the sag in modes below


def fall_acceleration(fit: ReleaseFit, t0: float) -> Array:
    """Return the acceleration in the fall, fitted together with a new instant near the release.

    The given instant was found for gravity, which would bias the result on a wrong scale towards it.  Sags that spring back in
    modes slow enough to resemble gravity have a tight prior.

    Parameters
    ----------
    fit : ReleaseFit
        Of `n` ends.
    t0 : float
        The release, s.

    Returns
    -------
    (2 n,) array
        One value per row of the data, m/s^2.
    """
    from scipy.optimize import minimize_scalar

    variance, noise = fit.noise(t0) ** 2, fit.mean_noise(t0)

    def fitted(instant: float) -> tuple[Array, float]:
        coefficients, left, held = _parabola(fit, instant, noise, fit.data - fit.sprung(instant, 0.0))
        return coefficients[-1], float(np.sum(left / variance) + held)

    grid = np.arange(max(t0 - _ANEW_S, fit.t[0] + _STEP_S), min(t0 + _ANEW_S, fit.t[-1] - 2 * _STEP_S), _STEP_S)
    near = min(grid, key=lambda instant: fitted(instant)[1])
    best = minimize_scalar(
        lambda instant: fitted(instant)[1], bounds=(near - _STEP_S, near + _STEP_S), method="bounded"
    )
    return np.asarray(fitted(float(best.x))[0])


def _parabola(fit: ReleaseFit, instant: float, noise: float, data: Array) -> tuple[Array, Array, float]:
    """Fit rows of data; return coefficients (the acceleration last), residual sum of squares per row, and penalty of priors."""
    after = np.maximum(fit.t - instant, 0.0)
    levitated, sags = fit.levitated(instant, 0.0), fit.sags(instant, 0.0)
    design = np.column_stack([*levitated, *sags, 0.5 * after**2])
    sizes = np.where(np.array(fit.bending_hz) > _QUICK_HZ, 1.0, _HELD) * fit.sag_sizes
    spread = np.concatenate([np.full(len(levitated), np.inf), sizes, [np.inf]])
    rows = np.vstack([design, np.diag(noise / spread)])
    coefficients, *_ = np.linalg.lstsq(rows, np.vstack([data.T, np.zeros((len(spread), len(data)))]), rcond=None)
    left = np.sum((data - (design @ coefficients).T) ** 2, axis=1)
    return coefficients, left, float(np.sum((coefficients[:-1] / spread[:-1, None]) ** 2))


def turning_alone(fit: ReleaseFit, t0: float) -> Array:
    """Return the greatest acceleration that once-per-revolution motion in the fall can imitate.

    A released rotor turns on about its axis of inertia and, if it bends, on an orbit of another size than in levitation.  In a
    fall of a few turns part of that resembles gravity, the more the faster it turns: 0.07 of gravity per micrometre at 300 Hz.
    The size of the orbit is fitted to the fall under gravity; a wide one after a narrow levitated orbit indicates a wrong scale,
    and counts as 0.  A fall of less than a turn does not determine the size: there it is that of the levitated orbit.

    Parameters
    ----------
    fit : ReleaseFit
        Of `n` ends.
    t0 : float
        The release, s.

    Returns
    -------
    (2 n,) array
        One value per row of the data, 0-pk, m/s^2; 0 if the speed is not known.
    """
    if not fit.speed_hz:
        return np.zeros(len(fit.data))
    free = fit.free(t0, 0.0)
    first = len(fit.levitated(t0, 0.0))
    told = (fit.t[-1] - t0) * fit.speed_hz >= 1
    size = np.hypot(*fit.solved(t0)[0][first : first + 2] if told else fit.solved(t0)[0][1:3])
    a_metre = np.hypot(*_parabola(fit, t0, fit.mean_noise(t0), np.array(free[:2]))[0][-1])
    return np.where(size < WIDE, size * a_metre, 0.0)


def gravity_alone(fit: ReleaseFit, t0: float, decay: float) -> tuple[Array, Array] | None:
    """Return the acceleration of gravity in the fall, separated from other motion, and its standard deviation.

    In a fall of less than a turn once-per-revolution motion resembles gravity; so its prior follows the levitated orbit.  The sag
    that springs back on a turning rotor also moves it sideways: the gyroscopic moment splits its frequency in two, which beat.
    The standard deviation includes the error of the model's bending frequencies.

    Parameters
    ----------
    fit : ReleaseFit
        Of `n` rows of data.
    t0, decay : float
        The release, and the decay time of the magnetic force, s.

    Returns
    -------
    two (n,) arrays, or None
        One value per row of the data, m/s^2; None if speed or bending frequencies are not known.
    """
    if not fit.speed_hz or len(fit.bending_hz) == 0:
        return None
    found, sigma = _freed(fit, t0, decay)
    others = [_freed(fit.stiffer(share), t0, decay)[0] for share in (1 - _BENDING, 1 + _BENDING)]
    return found, np.hypot(sigma, (others[1] - others[0]) / 2)


def _freed(fit: ReleaseFit, t0: float, decay: float) -> tuple[Array, Array]:
    """Return the acceleration of `gravity_alone` for given bending frequencies, and its standard deviation (noise and misfit)."""
    after = np.maximum(fit.t - t0, 0.0)
    levitated, free = fit.levitated(t0, decay), fit.free(t0, decay)
    orbit = max(_GOES_ON * float(np.hypot(*fit.solved(t0)[0][1:3]).max()), _LEAST_ORBIT)
    phases = [2 * np.pi * hz * after for hz in fit.bending_hz]
    beats = [np.sin(phase) - phase * np.cos(phase) for phase in phases]
    design = np.column_stack([*levitated, *free, *beats, let_go(0j, after, decay).real])
    sizes = fit.sag_sizes
    spread = np.concatenate([np.full(len(levitated), np.inf), [orbit, orbit], sizes, sizes, [np.inf]])
    noise = fit.mean_noise(t0)
    normal = design.T @ design + np.diag((noise / spread) ** 2)
    seen = fit.data - fit.sprung(t0, decay)
    fitted = np.linalg.solve(normal, design.T @ seen.T)
    left = (seen - (design @ fitted).T)[:, fit.t > t0]
    # the residual of a wrong bending frequency is no noise: scale with its mean square, not with the root
    misfit = max(1.0, float(np.mean((left / noise) ** 2)))
    sigma = noise * misfit * float(np.sqrt(fit.colour(left) * np.linalg.inv(normal)[-1, -1]))
    return np.asarray(fitted[-1]), np.asarray(sigma)
