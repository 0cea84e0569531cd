"""Selection of the stretch of a run-down that follows a single drag law, and of that law."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from tdbmon.analysis.autoregression import WHITE, Noise, noise_of, scatter
from tdbmon.analysis.drag_law import Coast, LawFit, fit_law

MODELS: dict[str, tuple[str, ...]] = {
    "exponential": ("linear",),
    "constant": ("constant",),
    "quadratic": ("quadratic",),
    "exponential + constant": ("linear", "constant"),
    "exponential + quadratic": ("linear", "quadratic"),
    "constant + quadratic": ("constant", "quadratic"),
    "constant + exponential + quadratic": ("linear", "constant", "quadratic"),
}
FEWEST = 24  # spans needed for a fit
_SETTLING_S = 3.0  # until contacts and spin-up of the rings are surely over; at most this share of the run-down:
_SETTLING_SHARE = 0.6
_EARLIER = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.08, 0.0)  # shares of the settling time
_SLOWER = (0.05, 0.03, 0.02, 0.01, 0.005, 0.002)  # shares of the speed at release
_LATER = (0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0)  # shares of a stretch, back from its end
_FEWEST_LAST = (4, 8)  # spans to determine a slope and its constancy, with known and with unknown noise
_CHANCE = {1: 10.83, 2: 13.82}  # 99.9 % quantiles of chi-square
# BIC by which another law must beat the exponential: "very strong" (Kass and Raftery, JASA 90, 1995)
_PREFERENCE = 10.0
_FOLDS = 8
NO_LAW = "no drag law fits the measured speed"
_BEYOND = 3.0  # times the noise, and times the residual of laws with free signs: a residual beyond is reported
_MATTERS, _FAR = (
    1e-3,
    0.02,
)  # of the loss of speed: least residual reported if such laws remove it, and if no law does


@dataclass(frozen=True)
class Candidate:
    """A law fitted to the chosen stretch.

    Attributes
    ----------
    name : str
        One of `MODELS`.
    fit : LawFit
        The fit.
    rms : float
        Residual of the mean speeds, Hz rms.
    held_out : float
        Mean square of the whitened residual on stretches left out of the fit (cross-validation).
    refused : str
        Why it cannot be chosen; empty if it can.
    """

    name: str
    fit: LawFit
    rms: float
    held_out: float
    refused: str = ""

    @property
    def power(self) -> float:
        """Mean square of the whitened residual."""
        return float(np.mean(self.fit.white**2))

    @property
    def score(self) -> float:
        """BIC, reduced for the plain exponential, which is preferred."""
        return self.fit.bic - (_PREFERENCE if self.name == "exponential" else 0.0)


def find_stretch(coast: Coast, release: float, stop: float) -> Coast | None:
    """Return the spans that follow a single drag law.

    Starts with spans long after the release and faster than a twentieth of the speed at release, and adds stretches on both
    sides as long as they need neither a step nor a slope of their own (Chow's test at 0.1 %); if one does, the stretch
    added before it is dropped too.

    Parameters
    ----------
    coast : Coast
        From the release on.
    release, stop : float
        Release, and end of rotation (or of the record), s.

    Returns
    -------
    Coast or None
        None if the record is too short for a fit.
    """
    settling = min(_SETTLING_S, _SETTLING_SHARE * (stop - release))
    rights = _slower(coast, stop)
    lefts = [release + share * settling for share in _EARLIER]
    lefts = [left for left in lefts if len(coast.between(left, rights[0])) >= FEWEST]
    if not lefts:
        return None
    inner = coast.between(lefts[0], rights[0])
    stretch = _Stretch(inner)
    earlier = stretch.grown(coast.between(left, inner.end[-1]) for left in lefts[1:])
    begin = stretch.coast.begin[0]
    later = stretch.grown(coast.between(begin, right) for right in rights[1:])
    safe = coast.between(earlier.begin[0], later.end[-1])
    return safe if len(safe) >= FEWEST else stretch.coast


def find_last_stretch(coast: Coast, noise: Noise | None) -> Coast:
    """Return the last spans that follow a single drag law; if the drive trips before the release, those after the trip.

    Extended backwards from the end as long as the addition needs neither a step nor a slope of its own, as in `find_stretch`.
    """
    last, length = float(coast.end[-1]), float(coast.end[-1] - coast.begin[0])
    lengths = [share * length for share in _LATER]
    fewest = _FEWEST_LAST[noise is None]
    begins = [last - each for each in lengths if len(coast.between(last - each, last)) >= fewest]
    if not begins:
        return coast
    stretch = _Stretch(coast.between(begins[0], last), noise)
    return stretch.grown(coast.between(begin, last) for begin in begins[1:])


def _slower(coast: Coast, stop: float) -> list[float]:
    """Return the times, s, at which the speed falls below fractions of its first value, then the end of rotation."""
    parts = coast.grouped(max(len(coast) // 200, 1))
    slower = [parts.mean < share * parts.mean[0] for share in _SLOWER]
    times = [float(parts.end[np.argmax(each)]) for each in slower if each.any()]
    return [*(t for t in times if t < stop), stop]


class _Stretch:
    """A stretch that is extended as long as one flexible law fits it."""

    def __init__(self, coast: Coast, noise: Noise | None = None) -> None:
        self.coast = coast
        fallen = 1 - coast.mean[-1] / coast.mean[0]
        self.terms = MODELS["constant + exponential + quadratic"] if fallen > 0.2 else MODELS["exponential + quadratic"]
        self.known = noise
        self._adopt(fit_law(coast, self.terms, noise or WHITE))

    def _adopt(self, fit: LawFit) -> None:
        self.law, self.noise = fit.law, self.known or noise_of(fit.residual, fit.parameters)

    def grown(self, wider: Iterable[Coast]) -> Coast:
        """Extend to wider stretches one after the other, and return the last that surely follows the law.

        If one fails the test, the one before it may contain the start of the deviation, and is not returned either.
        """
        joined = [self.coast]
        for each in wider:
            if not self._joins(each):
                return joined[-2:][0]
            joined.append(self.coast)
        return joined[-1]

    def _joins(self, wider: Coast) -> bool:
        """Adopt the wider stretch and return True if the spans it adds need no step and no slope of their own."""
        if len(wider) <= len(self.coast):
            return True
        fit = fit_law(wider, self.terms, self.noise, self.law)
        added = (wider.begin < self.coast.begin[0] - 1e-9) | (wider.end > self.coast.end[-1] + 1e-9)
        gain, limit = gain_apart(wider, fit, self.noise, added)
        if gain > limit:
            return False
        self.coast = wider
        self._adopt(fit)
        return True


def gain_apart(coast: Coast, fit: LawFit, noise: Noise, apart: np.ndarray) -> tuple[float, float]:
    """Return the decrease of chi-square if some spans (n,) get a step and slope of their own, and its 99.9 % limit by chance.

    Parameters
    ----------
    coast : Coast
    fit : LawFit
        Fit to it, with the same noise.
    noise : Noise
    apart : ndarray of bool (n,)
        These spans; fewer than four get a step only.
    """
    steps = [apart.astype(float)]
    if np.count_nonzero(apart) >= 4:
        steps.append(np.where(apart, coast.middle - coast.middle[apart].mean(), 0.0))
    columns = np.column_stack([noise.whiten(coast.measured(step)) for step in steps])
    columns = np.vstack([columns, np.zeros((len(fit.white) - len(columns), len(steps)))])
    basis, _ = np.linalg.qr(fit.sensitivity)
    columns -= basis @ (basis.T @ columns)
    solution, *_ = np.linalg.lstsq(columns, fit.white, rcond=1e-9)
    return float(np.sum((columns @ solution) ** 2)), _CHANCE[len(steps)]


def noise_in(stretch: Coast) -> Noise:
    """Return the noise model of the measured quantity, from the residual of the law with all terms."""
    fit = fit_law(stretch, MODELS["constant + exponential + quadratic"], WHITE)
    return noise_of(fit.residual, fit.parameters)


def choose_law(stretch: Coast, noise: Noise) -> tuple[list[Candidate], Candidate | None]:
    """Fit all `MODELS` to a stretch and choose the best.

    Parameters
    ----------
    stretch : Coast
        From `find_stretch`.
    noise : Noise
        From `noise_in`.

    Returns
    -------
    candidates : list of Candidate
        All, in the order of `MODELS`.
    chosen : Candidate or None
        None if every law has a term that would drive the rotor.
    """
    fits = [(name, fit_law(stretch, terms, noise)) for name, terms in MODELS.items()]
    candidates = [Candidate(name, fit, _rms(stretch, fit), _held_out(fit), _unphysical(fit)) for name, fit in fits]
    candidates = [_against_simpler(c, candidates) for c in candidates]
    standing = [c for c in candidates if not c.refused]
    return candidates, min(standing, key=lambda c: c.score) if standing else None


def misfit_of(chosen: Candidate, candidates: list[Candidate], stretch: Coast) -> str:
    """Return why even the chosen law does not describe drag alone; empty if it may."""
    if not _misses(chosen, candidates, stretch):
        return ""
    left = f"the best, {chosen.name}, has a residual of {chosen.rms:.2g} Hz rms at a noise of {scatter(stretch.mean):.2g} Hz"
    return (
        f"{NO_LAW} from {stretch.begin[0]:.3g} to {stretch.end[-1]:.3g} s ({left}): does the drive brake, do the rings still"
        " slip, or does the speed signal drift?"
    )


def _misses(candidate: Candidate, candidates: list[Candidate], stretch: Coast) -> bool:
    """Return whether a law clearly does not fit the speed.

    Autoregressive noise would absorb any lack of fit, so that the residual is compared with the scatter from mean to mean.
    Moreover, another law, even one with a driving term, must leave far less, or the residual must be too large for the drift of
    a speed signal.
    """
    fallen = float(stretch.mean[0] - stretch.mean[-1])
    if candidate.rms < _BEYOND * scatter(stretch.mean) or candidate.rms < _MATTERS * fallen:
        return False
    return candidate.rms > min(_BEYOND * min(c.rms for c in candidates), _FAR * fallen)


def _rms(stretch: Coast, fit: LawFit) -> float:
    return float(np.sqrt(np.mean((stretch.mean - fit.law.mean_between(stretch.begin, stretch.end)) ** 2)))


def _unphysical(fit: LawFit) -> str:
    driving = [term for term in fit.terms if getattr(fit.law, term) <= 0]
    return f"its {driving[0]} term would drive the rotor" if driving else ""


def _against_simpler(candidate: Candidate, candidates: list[Candidate]) -> Candidate:
    """Refuse a law unless it is better, in BIC and in cross-validation, than every simpler law nested in it."""
    if candidate.refused:
        return candidate
    for other in candidates:
        if other.refused or not set(other.fit.terms) < set(candidate.fit.terms):
            continue
        if candidate.score >= other.score or candidate.held_out >= other.held_out:
            return replace(candidate, refused=f"no better than {other.name}")
    return candidate


def _held_out(fit: LawFit) -> float:
    """Return the mean square whitened residual of successive parts, each predicted from the others (linearised at the fit)."""
    a, e = fit.sensitivity / np.linalg.norm(fit.sensitivity, axis=0), fit.white
    folds = np.array_split(np.arange(fit.measured), _FOLDS)
    normal, right = a.T @ a + 1e-12 * np.eye(a.shape[1]), a.T @ e
    others = np.stack([normal - a[rows].T @ a[rows] for rows in folds])
    pull = np.stack([a[rows].T @ e[rows] - right for rows in folds])
    steps = np.linalg.solve(others, pull[:, :, None])[:, :, 0]
    return (
        sum(float(np.sum((e[rows] + a[rows] @ step) ** 2)) for rows, step in zip(folds, steps, strict=True))
        / fit.measured
    )
