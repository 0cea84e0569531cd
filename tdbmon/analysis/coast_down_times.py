"""Coast-down times: when the speed has fallen to a half, and to a tenth, of that at the release.

Where the record reaches that speed, the time is read from the mean speeds around it, without a drag law: a parabola in time is
fitted to the widest band of speeds that it describes; if it describes none, as at the end of braking, the time lies between two
means.  Beyond the end of the record the chosen law is extrapolated; the interval then covers the laws with one more term too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from tdbmon.analysis.autoregression import noise_of, scatter
from tdbmon.analysis.drag_law import Coast, LawFit, slowing_time
from tdbmon.analysis.observed_speed import Observed
from tdbmon.analysis.standstill import FARTHEST
from tdbmon.estimate import Z95, Estimate
from tdbmon.quantity import percent

HALF, TENTH = 0.5, 0.1
_MEASURED, _EXTRAPOLATED = "measured", "extrapolated by the chosen law"
# half-widths of the fitted band, relative to the speed sought: in the first a parabola is accurate to some 1e-5 of it
_BANDS = (0.1, 0.05, 0.025, 0.0125)
_BENT, _BENDS = (
    3.0,
    5e-4,
)  # residual of a parabola, over the noise and over the speed: a larger one shows a kink in the speed curve
_EACH_SIDE = 5  # means at least, to each side of the crossing
_FEWEST = 8  # means in all, if the record ends soon after
_SMOOTH = 5  # means whose median is compared with the speed sought
_DRAWS = 2000


@dataclass(frozen=True)
class CoastDownTimes:
    """Times at which the speed has fallen to a half and to a tenth of that at the release.

    Attributes
    ----------
    half, tenth : Estimate
        From the record's first sample, s; the interval excludes the uncertainty of the release instant.
    """

    half: Estimate
    tenth: Estimate

    @classmethod
    def missing(cls, why: str) -> CoastDownTimes:
        """Return times both missing for the reason `why`."""
        return cls(Estimate.missing("s", why), Estimate.missing("s", why))


def how_told(time: Estimate) -> str:
    """Return whether a known time was measured or extrapolated, in words."""
    return _MEASURED if time.method.startswith(_MEASURED) else _EXTRAPOLATED


def coast_down_times(
    initial: Estimate, observed: Observed, laws: Sequence[LawFit], hidden: str, release: float, last: float
) -> CoastDownTimes:
    """Return when the speed has fallen to a half and to a tenth of that at the release.

    Parameters
    ----------
    initial : Estimate
        Speed at the release, Hz.
    observed : Observed
        Means of the speed.
    laws : sequence of LawFit
        The chosen law, then those with one more term; empty with a reason in `hidden`.
    hidden : str
        Why the law cannot be extrapolated beyond the record; empty if it can.
    release, last : float
        Release and end of the record, s.
    """
    if initial.value is None or initial.sigma is None:
        return CoastDownTimes.missing(initial.why)

    def reached(share: float) -> Estimate:
        wanted, sigma = share * float(initial.value or 0.0), share * float(initial.sigma or 0.0)
        zero = (1 - share) * float(np.hypot(observed.after.offset_sigma, observed.rest.level_sigma))
        read = _read(observed.after, wanted, float(np.hypot(sigma, zero)))
        if read is not None:
            return read
        if hidden:
            return Estimate.missing("s", f"the record does not show the speed falling to {percent(share)}, and {hidden}")
        return _by_law(laws, wanted, sigma, share, release, last)

    return CoastDownTimes(reached(HALF), reached(TENTH))


def _read(after: Coast, wanted: float, sigma: float) -> Estimate | None:
    """Return when the means fall below the speed `wanted` of standard deviation `sigma`, Hz; None if they do not show it."""
    from scipy.ndimage import median_filter

    if len(after) < _FEWEST:
        return None
    smooth = median_filter(after.mean, _SMOOTH, mode="nearest")
    below = np.flatnonzero(smooth < wanted)
    if not below.size or not below[0]:
        return None
    at = int(below[0])
    for band in _BANDS:
        above = np.flatnonzero(smooth[:at] > (1 + band) * wanted)
        under = np.flatnonzero(smooth[at:] < (1 - band) * wanted)
        first = max(min(int(above[-1]) + 1 if above.size else 0, at - _EACH_SIDE), 0)
        stop = min(max(at + int(under[0]) if under.size else len(smooth), at + _EACH_SIDE), len(smooth))
        if stop - first < _FEWEST:
            return None
        near = after.at(slice(first, stop))
        middle = float(after.middle[at])
        scale = float(np.abs(near.middle - middle).max())
        design = np.vander((near.middle - middle) / scale, 3)
        found, *_ = np.linalg.lstsq(design, near.mean, rcond=None)
        left = near.mean - design @ found
        smooth_there = float(np.std(left)) < max(_BENT * scatter(near.mean), _BENDS * wanted)
        if smooth_there and (crossing := _crossing(found, left, design, wanted, sigma, middle, scale)) is not None:
            return crossing
    return _between(after.middle, smooth, at, wanted, float(np.hypot(sigma, scatter(after.mean[first:stop]))))


def _crossing(
    found: np.ndarray, left: np.ndarray, design: np.ndarray, wanted: float, sigma: float, middle: float, scale: float
) -> Estimate | None:
    """Return when a parabola of coefficients `found` and residual `left` falls below a speed; its unit of time is `scale`, s."""
    roots = np.roots(found - [0.0, 0.0, wanted])
    real = roots.real[np.abs(roots.imag) < 1e-9]
    if not real.size:
        return None
    crossing = float(real[np.argmin(np.abs(real))])
    slope = 2 * found[0] * crossing + found[1]
    if abs(crossing) > 1 or slope >= 0:
        return None
    noise = noise_of(left, 3).slow
    row = np.array([crossing**2, crossing, 1.0])
    own = noise * float(np.sqrt(row @ np.linalg.pinv(design.T @ design) @ row))
    half = float(np.hypot(stdtrit(len(left) - 3, 0.975) * own, Z95 * sigma)) / -slope * scale
    when = middle + crossing * scale
    return Estimate(when, when - half, when + half, "s", f"{_MEASURED}: parabola fitted to the speed around it")


def _between(time: np.ndarray, smooth: np.ndarray, at: int, wanted: float, sigma: float) -> Estimate | None:
    """Return when the speed falls below `wanted` at a kink: between two means, with the slope of the flatter side."""
    step = float(time[at] - time[at - 1])
    first, last = max(at - _EACH_SIDE, 0), min(at + _EACH_SIDE, len(time) - 1)
    sides = [(smooth[i] - smooth[k]) / (time[k] - time[i]) for i, k in ((first, at), (at, last)) if k > i]
    if min(sides) <= 0:
        return None
    when = float(time[at] - step * (wanted - smooth[at]) / (smooth[at - 1] - smooth[at]))
    half = step + Z95 * sigma / float(min(sides))
    return Estimate(
        when, when - half, when + half, "s", f"{_MEASURED}: between two mean speeds, at a kink of the speed curve"
    )


def _by_law(laws: Sequence[LawFit], wanted: float, sigma: float, share: float, release: float, last: float) -> Estimate:
    """Return when the chosen law reaches the speed `wanted` of standard deviation `sigma`, Hz."""
    speeds = wanted + sigma * np.random.default_rng(21).standard_normal(_DRAWS)
    bounds = []
    for fit in laws:
        drawn = fit.draw(_DRAWS)
        braking = (drawn[:, 1:] >= 0).all(axis=1)  # a negative coefficient would drive the rotor
        if fit is laws[0] or braking.any():
            times = np.sort(fit.law.start + slowing_time(drawn[braking], speeds[braking]))
            if times.size:
                bounds += [times[int(0.025 * times.size)], times[int(0.975 * times.size)]]
    law = laws[0].law
    when = law.slowed_to(wanted)
    low, high = min([when, *bounds]), max([when, *bounds])
    if not high <= last + FARTHEST * (last - release):
        why = f"the record ends at {last:.3g} s, too early to say when the speed has fallen to {percent(share)}"
        return Estimate.missing("s", why)
    method = f"{_EXTRAPOLATED}; interval includes laws with one more term"
    return Estimate(when, float(low), float(high), "s", method)
