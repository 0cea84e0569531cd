"""Points drawn from a fit's covariance: to propagate its uncertainty to derived quantities, and to find a deeper minimum.

Paths with impacts make the misfit rugged: a descent ends in one local minimum of many.  Fits begun at drawn points end in
others within the uncertainty, and the best is kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tdbmon.identify.least_squares import Fit, covariance_of, fit_or_none
from tdbmon.identify.problem import Problem

Array = NDArray[np.float64]

_STARTS, _TIMES = 4, 2  # starts per round, and rounds at most while they still gain
_GAIN = 0.003  # relative gain of the misfit, from which on another round is worth it
_SLOPES = 2  # Jacobians per fit


def draws(problem: Problem, point: Array, covariance: Array, members: int, rng: np.random.Generator) -> list[Array]:
    """Return the fitted point, then points drawn about it and clipped to the bounds."""
    drawn = point + rng.standard_normal((members - 1, len(point))) @ root_of(covariance).T
    return [point, *np.clip(drawn, problem.low, problem.high)]


def root_of(covariance: Array) -> Array:
    """Return a square root R (n, n) of a covariance C = R R^T (n, n)."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def shaken(problem: Problem, found: Fit, horizon: float) -> Fit:
    """Return the best of a fit and of those begun at points drawn about it.

    Parameters
    ----------
    problem : Problem
    found : Fit
        With a Jacobian good enough for its covariance.
    horizon : float
        s after the release.
    """
    rng = np.random.default_rng(0)
    for _ in range(_TIMES):
        _, *starts = draws(problem, found.point, covariance_of(problem, found, horizon), _STARTS + 1, rng)
        tried = problem.crew.apart(fit_or_none, [(problem, start, horizon, _SLOPES) for start in starts])
        before = found.misfit
        found = min([found, *(each for each in tried if each is not None)], key=lambda each: each.misfit)
        if found.misfit > (1 - _GAIN) * before:
            break
    return found
