"""Which stretch of a run-down follows one law of drag, and which law that is."""

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
FEWEST = 24  # spans that a fit needs
_SETTLING_S = 3.0  # contacts and spin-up of the rings are surely over by then; in short records this share of the rest:
_SETTLING_SHARE = 0.6
_EARLIER = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.08, 0.0)  # shares of the settling time
_SLOWER = (0.05, 0.03, 0.02, 0.01, 0.005, 0.002)  # shares of the speed at release
_LATER = (0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0)  # shares of a stretch, back from its end
_FEWEST_LAST = (4, 8)  # spans that tell a slope and that it stays, with noise that is known and that is not
_CHANCE = {1: 10.83, 2: 13.82}  # 99.9 % quantiles of chi-square
# BIC by which another law must beat the exponential: "very strong" (Kass and Raftery, JASA 90, 1995)
_PREFERENCE = 10.0
_FOLDS = 8
NO_LAW = "no law of drag fits how the speed falls"
_BEYOND = 3.0  # times the noise, and times what laws of free signs leave: a misfit that is told
_MATTERS, _FAR = (
    1e-3,
    0.02,
)  # of what the speed fell by: a misfit that such laws take away, and one that no law takes away


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
        Misfit of the mean speeds, Hz.
    held_out : float
        Mean square of the whitened misfit on stretches left out of the fit.
    refused : str
        Why it cannot be chosen; empty where it can.
    """

    name: str
    fit: LawFit
    rms: float
    held_out: float
    refused: str = ""

    @property
    def power(self) -> float:
        """Mean square of the whitened misfit."""
        return float(np.mean(self.fit.white**2))

    @property
    def score(self) -> float:
        """BIC with the preference for the plain exponential."""
        return self.fit.bic - (_PREFERENCE if self.name == "exponential" else 0.0)


def find_stretch(coast: Coast, release: float, stop: float) -> Coast | None:
    """Return the spans that follow one law.

    Starts with spans long after the release and faster than a twentieth of the speed at release, and adds stretches on both
    sides for as long as they need neither a step nor a slope of their own (Chow's test at 0.1 %); where one does, the stretch
    next to it is given up too.

    Parameters
    ----------
    coast : Coast
        From the release on.
    release, stop : float
        Release, and end of rotation (or of the record), s.

    Returns
    -------
    Coast or None
        None where the record is too short for a fit.
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
    """Return the last spans that follow one law: where a drive trips before the release, those after it.

    Widened back from the end for as long as what is added needs neither a step nor a slope of its own, as in `find_stretch`.
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
    """Times at which the speed falls below shares of the first, up to the end of rotation."""
    parts = coast.grouped(max(len(coast) // 200, 1))
    slower = [parts.mean < share * parts.mean[0] for share in _SLOWER]
    times = [float(parts.end[np.argmax(each)]) for each in slower if each.any()]
    return [*(t for t in times if t < stop), stop]


class _Stretch:
    """A stretch that grows for as long as one flexible law fits it."""

    def __init__(self, coast: Coast, noise: Noise | None = None) -> None:
        self.coast = coast
        fallen = 1 - coast.mean[-1] / coast.mean[0]
        self.terms = MODELS["constant + exponential + quadratic"] if fallen > 0.2 else MODELS["exponential + quadratic"]
        self.known = noise
        self._adopt(fit_law(coast, self.terms, noise or WHITE))

    def _adopt(self, fit: LawFit) -> None:
        self.law, self.noise = fit.law, self.known or noise_of(fit.residual, fit.parameters)

    def grown(self, wider: Iterable[Coast]) -> Coast:
        """Join wider stretches one after the other, and return the last that surely follows the law.

        Where one does not join, the one before it may hold a little of what spoilt it.
        """
        joined = [self.coast]
        for each in wider:
            if not self._joins(each):
                return joined[-2:][0]
            joined.append(self.coast)
        return joined[-1]

    def _joins(self, wider: Coast) -> bool:
        """Adopt the wider stretch and return True if what it adds needs no step and no slope of its own."""
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
    """Return by how much chi-square falls where some spans (n,) get a step and a slope of their own, and what chance reaches.

    Parameters
    ----------
    coast : Coast
    fit : LawFit
        Of it, with the same noise.
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
    """Noise of the measured quantity, from what the fullest law leaves."""
    fit = fit_law(stretch, MODELS["constant + exponential + quadratic"], WHITE)
    return noise_of(fit.residual, fit.parameters)


def choose_law(stretch: Coast, noise: Noise) -> tuple[list[Candidate], Candidate | None]:
    """Fit all `MODELS` and choose.

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
        None where no law slows the rotor.
    """
    fits = [(name, fit_law(stretch, terms, noise)) for name, terms in MODELS.items()]
    candidates = [Candidate(name, fit, _rms(stretch, fit), _held_out(fit), _unphysical(fit)) for name, fit in fits]
    candidates = [_against_simpler(c, candidates) for c in candidates]
    standing = [c for c in candidates if not c.refused]
    return candidates, min(standing, key=lambda c: c.score) if standing else None


def misfit_of(chosen: Candidate, candidates: list[Candidate], stretch: Coast) -> str:
    """Say why not even the chosen law is that of a drag; empty where it may be."""
    if not _misses(chosen, candidates, stretch):
        return ""
    left = f"{chosen.name}, the best, leaves {chosen.rms:.2g} Hz rms beside {scatter(stretch.mean):.2g} Hz of noise"
    return (
        f"{NO_LAW} from {stretch.begin[0]:.3g} to {stretch.end[-1]:.3g} s ({left}): does the drive brake, do the rings still"
        " slip, or does the speed signal wander?"
    )


def _misses(candidate: Candidate, candidates: list[Candidate], stretch: Coast) -> bool:
    """True where a law plainly misses the speed.

    Noise that remembers would take any misfit for its own, so that the misfit is held against the scatter from mean to mean.
    And either another law, be it one that partly drives the rotor, has far less of it, or it is too large for the wander of a
    speed signal.
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
    """Refuse a law that does not better a simpler one that it contains, in BIC and on what was held out."""
    if candidate.refused:
        return candidate
    for other in candidates:
        if other.refused or not set(other.fit.terms) < set(candidate.fit.terms):
            continue
        if candidate.score >= other.score or candidate.held_out >= other.held_out:
            return replace(candidate, refused=f"no better than {other.name}")
    return candidate


def _held_out(fit: LawFit) -> float:
    """Mean square of the whitened misfit on successive stretches, each predicted from the others (linearised at the fit)."""
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
