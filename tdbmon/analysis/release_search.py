"""Least-squares estimate of the release with the model of `tdbmon.analysis.release_fit`, and its confidence interval.

A faulty probe at one end must not determine the release: each end is weighted by the residuals of its own best fit in the fall,
the interval is widened if the instants of the single ends disagree (R. T. Birge, Phys. Rev. 40 (1932) 207), and a soft start
(decaying force) is accepted only if no single end contradicts it.  If a sudden and a soft start fit about equally well, the
interval covers both.  A scale error of the probes of a few per cent mimics a soft start: if a sudden release with a scale within
their tolerance fits about as well, the decay is not certain.  With larger scale errors the two differ: if a sudden release with
free scales fits better than any decay and leaves only noise, a sensitivity is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tdbmon.analysis.release_fit import Array, ReleaseFit
from tdbmon.estimate import Z95

_MODEL_S = 12e-6  # model error due to higher bending modes: rms error on synthetic drops with a known release
_ALONE_S = 25e-6  # the same for a single end: the errors of two ends largely cancel
_BENDING = 0.015  # relative standard deviation of the machine file's bending frequencies: elastic modulus within 3 %
_BENT_S = 1e-3  # range of the instant when they vary
_WORSE = 1.5  # largest accepted ratio of costs with and without the sag; a probe that reads 10 % too much gives 1.05
_SOFT_MODEL = 0.03  # relative model error of the decay time: the levitation stiffness, which decays too, is neglected
_SOFT_S = 6e-5  # model error of decay time and instant (anticorrelated): neglected modes bias a short decay
_WITHIN = 3.84  # 95 % quantile of chi-square with one degree of freedom
_SURE = 36.0  # decrease of chi-square from which a soft start is accepted
_DOUBT = 12.0  # decrease from which it is considered possible
_AGAINST = 10.0  # decrease by which a single end may favour a sudden release at its own instant
PROBE_SCALE = 0.05  # relative tolerance of an eddy-current probe's scale factor (API Standard 670)
_BEYOND, _ANY_SCALE = 0.075, 0.5  # relative error of a wrong sensitivity: clearly beyond the tolerance, and at most
_NOISE_ALONE = 2.0  # largest mean square residual in the fall over noise variance, if scale errors explain it
_MISREAD = 50.0  # decrease of chi-square by a free scale that sound records do not show
_STEP_S = 2.5e-4  # grid step of the first search
_NEAR_S = 3e-3  # range of the later searches around its result
_LEAST_DECAY_S = 1e-4
_MIMICKED_S = 5e-4  # a shorter decay may be neglected bending: not reported unless certain


@dataclass(frozen=True)
class FittedRelease:
    """Release instant with its 95 % interval, s, and decay time with its limits, s, if the start may be soft.

    `misread` is the decay time, s, if a sudden release with a scale within the probes' tolerance fits about as well; else 0.
    `scales` is reading over true displacement by end, if a sudden release fits the fall only with these; else empty.
    """

    time: float
    low: float
    high: float
    decay: tuple[float, float, float] | None
    misread: float = 0.0
    scales: tuple[float, ...] = ()


def search_release(fit: ReleaseFit, low: float, high: float) -> FittedRelease:
    """Return the best-fitting release between two instants, s."""
    rough = _sudden_together(fit, low, high)
    near = rough - _NEAR_S, rough + _NEAR_S
    best, alone = _sudden(_by_noise(fit, rough), *near)
    white = _by_noise(fit, best)
    t0, decay = _soft(white, best)
    if decay > _LEAST_DECAY_S and white.cost(best) - white.cost(t0, decay) > _DOUBT:
        gentle = [_soft(white, instant, end) for end, instant in enumerate(alone)]
        soft = _softly(_by_what_is_left(white, gentle), near)
        if soft is not None:
            return soft
    return _suddenly(_by_what_is_left(white, [(instant, 0.0) for instant in alone]), near)


def unless_worse(one: ReleaseFit, other: ReleaseFit, low: float, high: float) -> ReleaseFit:
    """Return the first of two fits, unless the other has a clearly lower cost for a sudden release between two instants, s."""
    left = [each.cost(_sudden_together(each, low, high)) for each in (one, other)]
    return one if left[0] <= _WORSE * left[1] else other


def _by_noise(fit: ReleaseFit, t0: float) -> ReleaseFit:
    """Return the fit with each row weighted by its residual variance in the levitated stretch before an instant, s."""
    return replace(fit, variance=np.maximum(fit.noise(t0) ** 2, 1e-18))


def _by_what_is_left(fit: ReleaseFit, laws: Sequence[tuple[float, float]]) -> ReleaseFit:
    """Return the fit with each end weighted by its residual variance in the fall, with its own (t0, T)."""
    return replace(fit, variance=fit.variances * _excess(fit, laws, fit.variances))


def _softly(fit: ReleaseFit, near: tuple[float, float]) -> FittedRelease | None:
    """Return the release in a range of instants, s, as that of a decaying force; None if the fit does not support one."""
    best, alone = _sudden(fit, *near)
    t0, decay = _soft(fit, best)
    gain = fit.cost(best) - fit.cost(t0, decay)
    apart = _apart(fit, alone)
    each = apart - fit.costs(t0, decay)
    if decay <= _LEAST_DECAY_S or gain <= _DOUBT or np.any(each <= -_AGAINST):
        return None
    soft = _profile(fit, t0, decay)
    if gain <= _SURE:
        return _either(fit, best, soft)
    scaled = _sudden_on_any_scale(fit, best, t0)
    within = fit.on_any_scale(scaled, PROBE_SCALE)[0]
    misscaled = _misscaled(fit, min(fit.cost(t0, decay), apart.sum(), within) - _DOUBT, best, t0)
    if misscaled is not None:
        return misscaled
    soft = _with_scale(fit, soft)
    if within - fit.cost(t0, decay) < _SURE:
        return replace(_either(fit, scaled, soft), misread=decay)
    return soft


def _suddenly(fit: ReleaseFit, near: tuple[float, float]) -> FittedRelease:
    """Return the release in a range of instants, s, as a sudden one."""
    best, alone = _sudden(fit, *near)
    scaled = _sudden_on_any_scale(fit, best)
    within = fit.on_any_scale(scaled, PROBE_SCALE)[0]
    least = min(fit.cost(best) - _MISREAD, _apart(fit, alone).sum() - _DOUBT, within - _DOUBT)
    misscaled = _misscaled(fit, least, best)
    if misscaled is not None:
        return misscaled
    errors = [np.hypot(fit.sigma(best, end), _MODEL_S) for end in range(len(alone))]
    scatter = float(np.sum(((np.array(alone) - best) / errors) ** 2)) / max(1, len(alone) - 1)
    half = Z95 * float(np.hypot(fit.sigma(best), _model(fit, best)) * np.sqrt(max(1.0, scatter)))
    low, high = best - half, best + half
    if fit.cost(best) - within > _MISREAD:
        low, high = min(low, scaled - half), max(high, scaled + half)
    return FittedRelease(best, low, high, None)


def _model(fit: ReleaseFit, t0: float) -> float:
    """Return the model error of an instant, s: that of higher bending modes, and that of the bending frequencies."""
    higher = _MODEL_S if len(fit.data) > 2 else _ALONE_S
    if fit.sag is None:
        return higher
    low, high = (_sudden_together(fit.stiffer(1 + off), t0 - _BENT_S, t0 + _BENT_S) for off in (-_BENDING, _BENDING))
    return float(np.hypot(higher, (high - low) / 2))


def _with_scale(fit: ReleaseFit, soft: FittedRelease) -> FittedRelease:
    """Widen the intervals of instant and decay time by their change with a scale at the limits of the probes' tolerance."""
    if soft.decay is None:
        return soft
    decay, shortest, longest = soft.decay
    instants, decays = zip(*(_soft(fit, soft.time, scale=1 + off) for off in (-PROBE_SCALE, PROBE_SCALE)), strict=True)
    low, high = _widened(soft.time, soft.low, soft.high, instants)
    shortest, longest = _widened(decay, shortest, longest, decays)
    return replace(soft, low=low, high=high, decay=(decay, max(0.0, shortest), longest))


def _either(fit: ReleaseFit, sudden: float, soft: FittedRelease) -> FittedRelease:
    """Return a sudden release, which is the usual one, with an interval that covers the soft one too."""
    half = Z95 * float(np.hypot(fit.sigma(sudden), _model(fit, sudden)))
    decay = None
    if soft.decay is not None and soft.decay[1] > _MIMICKED_S:
        decay = (soft.decay[0], 0.0, soft.decay[2])
    return FittedRelease(sudden, min(soft.low, sudden - half), max(soft.high, sudden + half), decay)


def _apart(fit: ReleaseFit, alone: Sequence[float]) -> Array:
    """Return the cost of each end for a sudden release at its own instant."""
    return np.array([fit.costs(instant)[end] for end, instant in enumerate(alone)])


def _sudden(fit: ReleaseFit, low: float, high: float) -> tuple[float, list[float]]:
    """Return the instant of a sudden release between two instants, s, from all ends together and from each alone."""
    grid, costs = _coarsely(fit, low, high)
    ends = range(costs.shape[1])
    return _least(fit, grid, costs, [*ends]), [_least(fit, grid, costs, [end]) for end in ends]


def _sudden_together(fit: ReleaseFit, low: float, high: float) -> float:
    """Return the instant of a sudden release between two instants, s, from all ends together."""
    grid, costs = _coarsely(fit, low, high)
    return _least(fit, grid, costs, [*range(costs.shape[1])])


def _coarsely(fit: ReleaseFit, low: float, high: float) -> tuple[Array, Array]:
    """Return a coarse grid of instants (m,), s, and the cost of every end for a sudden release at each of them (m, n)."""
    grid = np.arange(max(low, fit.t[0] + 4e-3), min(high, fit.t[-1] - 5e-4), _STEP_S)
    return grid, np.array([fit.costs(t0) for t0 in grid])


def _least(fit: ReleaseFit, grid: Array, costs: Array, which: list[int]) -> float:
    """Return the instant of least cost of selected ends for a sudden release, refined from the best of a grid, s."""
    from scipy.optimize import minimize_scalar

    centre = grid[int(np.argmin(costs[:, which].sum(axis=1)))]
    span, exact = (centre - _STEP_S, centre + _STEP_S), {"xatol": 1e-7}
    best = minimize_scalar(lambda t0: float(fit.costs(t0)[which].sum()), bounds=span, method="bounded", options=exact)
    return float(best.x)


def _sudden_on_any_scale(fit: ReleaseFit, *near: float, reach: float = PROBE_SCALE) -> float:
    """Return the instant of a sudden release of least cost with free scales within 1 ± `reach`, near given instants, s."""
    from scipy.optimize import minimize_scalar

    def left(instant: float) -> float:
        return fit.on_any_scale(instant, reach)[0]

    grid = np.arange(min(near) - 1e-3, max(near) + 1e-3, _STEP_S / 2)
    rough = float(min(grid, key=left))
    span = (rough - _STEP_S / 2, rough + _STEP_S / 2)
    return float(minimize_scalar(left, bounds=span, method="bounded", options={"xatol": 1e-7}).x)


def _misscaled(fit: ReleaseFit, least: float, *near: float) -> FittedRelease | None:
    """Return a sudden release with scales beyond the probes' tolerance whose cost is at most `least`; None if there is none."""
    found = _sudden_on_any_scale(fit, *near, reach=_ANY_SCALE)
    left, scales = fit.on_any_scale(found, _ANY_SCALE)
    beyond = bool(np.any(np.abs(scales - 1) > _BEYOND))
    if not beyond or left > least or not _noise_alone(fit, found, scales):
        return None
    about = found + np.arange(-1e-3, 1e-3, _STEP_S / 10)
    also = about[[fit.on_any_scale(instant, _ANY_SCALE)[0] - left <= _WITHIN for instant in about]]
    model = Z95 * _ALONE_S
    return FittedRelease(
        found, float(also.min()) - model, float(also.max()) + model, None, scales=tuple(scales.tolist())
    )


def _noise_alone(fit: ReleaseFit, t0: float, scales: Array) -> bool:
    """Return True if a sudden release with these scales leaves only noise in the fall; a delayed channel leaves more."""
    white = fit.noise(t0) ** 2
    return all(
        fit.over_noise(fit.left_in_fall(end, t0, scale=float(scale)), white, end) <= _NOISE_ALONE
        for end, scale in enumerate(scales)
    )


def _soft(fit: ReleaseFit, start: float, end: int | None = None, scale: float = 1.0) -> tuple[float, float]:
    """Return instant and decay time of a soft release, s, from all ends or one; `scale` is reading over true displacement."""
    from scipy.optimize import minimize

    def misfit(point: Array) -> float:
        costs = fit.costs(point[0] * 1e-3, abs(point[1]) * 1e-3, scale)
        return float(costs.sum() if end is None else costs[end])

    options = {"xatol": 1e-3, "fatol": 0.05}
    found = minimize(misfit, [start * 1e3 - 0.5, 1.0], method="Nelder-Mead", options=options)
    return float(found.x[0]) * 1e-3, abs(float(found.x[1])) * 1e-3


def _excess(fit: ReleaseFit, laws: Sequence[tuple[float, float]], white: Array) -> Array:
    """Return the factor by which the variance of each row in the fall exceeds the noise, for the (t0, T) of each end.

    Mean square residual over noise variance, at least one, times the variance inflation due to autocorrelation.
    """
    factors = []
    for end, (t0, decay) in enumerate(laws):
        left = fit.left_in_fall(end, t0, decay)
        factors.append(max(1.0, fit.over_noise(left, white, end)) * fit.colour(left))
    return np.repeat(factors, 2)


def _profile(fit: ReleaseFit, t0: float, decay: float) -> FittedRelease:
    """Return instant and decay time with profile-likelihood intervals, since the model is far from linear in the two."""
    from scipy.optimize import minimize_scalar

    decays = np.concatenate([[decay], decay * np.geomspace(0.1, 5.0, 41)])
    span = (t0 - 2e-3, t0 + 2e-3)
    found = [
        minimize_scalar(lambda t, d=d: fit.cost(t, d), bounds=span, method="bounded", options={"xatol": 1e-6})
        for d in decays
    ]
    costs, instants = np.array([f.fun for f in found]), np.array([f.x for f in found])
    near = costs - costs.min() <= _WITHIN
    value, best = float(instants[int(np.argmin(costs))]), float(decays[int(np.argmin(costs))])
    reach = max(value - instants[near].min(), instants[near].max() - value) + Z95 * fit.sigma(t0)
    half = float(np.hypot(reach, Z95 * np.hypot(_SOFT_S, _SOFT_MODEL * best)))
    wider = Z95 * float(np.hypot(_SOFT_S, _SOFT_MODEL * best))
    low, high = best - np.hypot(best - decays[near].min(), wider), best + np.hypot(decays[near].max() - best, wider)
    return FittedRelease(value, value - half, value + half, (best, max(0.0, float(low)), float(high)))


def _widened(value: float, low: float, high: float, others: Sequence[float]) -> tuple[float, float]:
    """Return the interval of a value, widened by its distance to alternative values as by an independent error."""
    down, up = max(0.0, value - min(others)), max(0.0, max(others) - value)
    return value - float(np.hypot(value - low, down)), value + float(np.hypot(high - value, up))
