"""The release that laws of the fall explain best (`tdbmon.analysis.release_fit`), and how sure it is.

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

import numpy as np

from tdbmon.analysis.release_fit import Array, ReleaseFit
from tdbmon.estimate import Z95

_MODEL_S = 12e-6  # what higher bending modes leave: the error's rms on synthetic drops with a known release
_ALONE_S = 25e-6  # the same of one end alone: two ends' errors largely cancel
_BENDING = 0.015  # of the bending frequencies by the machine file, standard deviation: an elastic modulus within 3 %
_BENT_S = 1e-3  # as far as the instant may move with them
_WORSE = 1.5  # times what is left without the sag; a probe that reads a tenth too much makes it 1.05
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


def search_release(fit: ReleaseFit, low: float, high: float) -> FittedRelease:
    """Find the release between two instants."""
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
    """Return the first of two fits, or the other where that plainly leaves less of a sudden release between two instants."""
    left = [each.cost(_sudden_together(each, low, high)) for each in (one, other)]
    return one if left[0] <= _WORSE * left[1] else other


def _by_noise(fit: ReleaseFit, t0: float) -> ReleaseFit:
    """Return the fit with each row counted by the noise that the levitated law leaves before an instant."""
    return replace(fit, variance=np.maximum(fit.noise(t0) ** 2, 1e-18))


def _by_what_is_left(fit: ReleaseFit, laws: Sequence[tuple[float, float]]) -> ReleaseFit:
    """Return the fit with each end counted by what its own law (t0, T) leaves in the fall."""
    return replace(fit, variance=fit.variances * _excess(fit, laws, fit.variances))


def _softly(fit: ReleaseFit, near: tuple[float, float]) -> FittedRelease | None:
    """Return the release about some instants as one of a force that dies away; None where it is not plainly that."""
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
    """Return the release about some instants as a sudden one."""
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
    """What higher bending modes leave, and how far an instant moves with the bending frequencies, s."""
    higher = _MODEL_S if len(fit.data) > 2 else _ALONE_S
    if fit.sag is None:
        return higher
    low, high = (_sudden_together(fit.stiffer(1 + off), t0 - _BENT_S, t0 + _BENT_S) for off in (-_BENDING, _BENDING))
    return float(np.hypot(higher, (high - low) / 2))


def _with_scale(fit: ReleaseFit, soft: FittedRelease) -> FittedRelease:
    """Widen the ranges of instant and decay time by what a scale at the limits of the probes' tolerance makes of them."""
    if soft.decay is None:
        return soft
    decay, shortest, longest = soft.decay
    instants, decays = zip(*(_soft(fit, soft.time, scale=1 + off) for off in (-PROBE_SCALE, PROBE_SCALE)), strict=True)
    low, high = _widened(soft.time, soft.low, soft.high, instants)
    shortest, longest = _widened(decay, shortest, longest, decays)
    return replace(soft, low=low, high=high, decay=(decay, max(0.0, shortest), longest))


def _either(fit: ReleaseFit, sudden: float, soft: FittedRelease) -> FittedRelease:
    """Return a sudden release, which is the usual one, with an interval that holds the soft one too."""
    half = Z95 * float(np.hypot(fit.sigma(sudden), _model(fit, sudden)))
    decay = None
    if soft.decay is not None and soft.decay[1] > _MIMICKED_S:
        decay = (soft.decay[0], 0.0, soft.decay[2])
    return FittedRelease(sudden, min(soft.low, sudden - half), max(soft.high, sudden + half), decay)


def _apart(fit: ReleaseFit, alone: Sequence[float]) -> Array:
    """Sum of squares of each end, released suddenly at an instant of its own."""
    return np.array([fit.costs(instant)[end] for end, instant in enumerate(alone)])


def _sudden(fit: ReleaseFit, low: float, high: float) -> tuple[float, list[float]]:
    """Return the instant of a sudden release, of all ends together and of each alone."""
    grid, costs = _coarsely(fit, low, high)
    ends = range(costs.shape[1])
    return _least(fit, grid, costs, [*ends]), [_least(fit, grid, costs, [end]) for end in ends]


def _sudden_together(fit: ReleaseFit, low: float, high: float) -> float:
    """Return the instant of a sudden release of all ends together."""
    grid, costs = _coarsely(fit, low, high)
    return _least(fit, grid, costs, [*range(costs.shape[1])])


def _coarsely(fit: ReleaseFit, low: float, high: float) -> tuple[Array, Array]:
    """Return instants (m,) in coarse steps, s, and what a sudden release at each leaves of every end (m, n)."""
    grid = np.arange(max(low, fit.t[0] + 4e-3), min(high, fit.t[-1] - 5e-4), _STEP_S)
    return grid, np.array([fit.costs(t0) for t0 in grid])


def _least(fit: ReleaseFit, grid: Array, costs: Array, which: list[int]) -> float:
    """Return the instant near the best of some, at which a sudden release leaves the least of some ends, s."""
    from scipy.optimize import minimize_scalar

    centre = grid[int(np.argmin(costs[:, which].sum(axis=1)))]
    span, exact = (centre - _STEP_S, centre + _STEP_S), {"xatol": 1e-7}
    best = minimize_scalar(lambda t0: float(fit.costs(t0)[which].sum()), bounds=span, method="bounded", options=exact)
    return float(best.x)


def _sudden_on_any_scale(fit: ReleaseFit, *near: float, reach: float = PROBE_SCALE) -> float:
    """Return the instant near some others of a sudden release that scales within reach explain best, s."""
    from scipy.optimize import minimize_scalar

    def left(instant: float) -> float:
        return fit.on_any_scale(instant, reach)[0]

    grid = np.arange(min(near) - 1e-3, max(near) + 1e-3, _STEP_S / 2)
    rough = float(min(grid, key=left))
    span = (rough - _STEP_S / 2, rough + _STEP_S / 2)
    return float(minimize_scalar(left, bounds=span, method="bounded", options={"xatol": 1e-7}).x)


def _misscaled(fit: ReleaseFit, least: float, *near: float) -> FittedRelease | None:
    """Return a sudden release on scales beyond the probes' tolerance that leave less than `least`; None where none does."""
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
    """Whether a sudden release on such scales leaves about what noise would in the fall: a late channel leaves more."""
    white = fit.noise(t0) ** 2
    return all(
        fit.over_noise(fit.left_in_fall(end, t0, scale=float(scale)), white, end) <= _NOISE_ALONE
        for end, scale in enumerate(scales)
    )


def _soft(fit: ReleaseFit, start: float, end: int | None = None, scale: float = 1.0) -> tuple[float, float]:
    """Return instant and decay time of a soft release, of all ends together or of one alone; for readings on a `scale`."""
    from scipy.optimize import minimize

    def misfit(point: Array) -> float:
        costs = fit.costs(point[0] * 1e-3, abs(point[1]) * 1e-3, scale)
        return float(costs.sum() if end is None else costs[end])

    options = {"xatol": 1e-3, "fatol": 0.05}
    found = minimize(misfit, [start * 1e3 - 0.5, 1.0], method="Nelder-Mead", options=options)
    return float(found.x[0]) * 1e-3, abs(float(found.x[1])) * 1e-3


def _excess(fit: ReleaseFit, laws: Sequence[tuple[float, float]], white: Array) -> Array:
    """Return by how much the variance of each row exceeds the noise in the fall, for the law (t0, T) of each end.

    Mean square of what is left over that of the noise, at least one, times what autocorrelation inflates a sum by.
    """
    factors = []
    for end, (t0, decay) in enumerate(laws):
        left = fit.left_in_fall(end, t0, decay)
        factors.append(max(1.0, fit.over_noise(left, white, end)) * fit.colour(left))
    return np.repeat(factors, 2)


def _profile(fit: ReleaseFit, t0: float, decay: float) -> FittedRelease:
    """Ranges of instant and decay time in which the cost stays near its least: the two are far from linear."""
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
    """Return an interval widened, as by an independent error, to what the value would be otherwise."""
    down, up = max(0.0, value - min(others)), max(0.0, max(others) - value)
    return value - float(np.hypot(value - low, down)), value + float(np.hypot(high - value, up))
