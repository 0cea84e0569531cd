"""Noise that remembers: an autoregression of what a fit leaves, and the filter that makes it white (G. U. Yule 1927)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_MAX_ORDER = 6


@dataclass(frozen=True)
class Noise:
    """Autoregressive noise of the measured quantity: coefficients (p,) and standard deviation of the innovation."""

    ar: np.ndarray
    sigma: float

    @property
    def slow(self) -> float:
        """Standard deviation of the white noise that is as strong at low frequency."""
        return self.sigma / max(1.0 - float(self.ar.sum()), 0.05)

    def whiten(self, x: np.ndarray) -> np.ndarray:
        """Return x (n, ...) filtered to white noise of standard deviation one, (n - p, ...)."""
        return whitened(x.T, self.ar).T[len(self.ar) :] / self.sigma


WHITE = Noise(np.empty(0), 1.0)


def whitened(values: np.ndarray, ar: np.ndarray) -> np.ndarray:
    """Return values[t] - sum ar[k] values[t - k] along the last axis; a term of `ar` may differ from row to row.

    Values before the first count as 0.
    """
    out = values.copy()
    for lag, coefficient in enumerate(ar, start=1):
        out[..., lag:] -= coefficient * values[..., :-lag]
    return out


def noise_of(residual: np.ndarray, parameters: int) -> Noise:
    """Fit an autoregression to a residual (n,) left by a fit of so many parameters.

    Yule-Walker's equations; the order is the one with the least BIC, at most 6.  They give stationary noise whatever is left,
    of a few means or of nothing but rounding too.  Least squares, as `tdbmon.identify.noise` has them, do not; of long stretches
    they keep sharp peaks, which Yule-Walker's equations flatten.
    """
    n = len(residual)
    top = max(0, min(_MAX_ORDER, (n - parameters) // 20))
    e = residual - residual.mean()
    lags = np.array([e[k:] @ e[: n - k] for k in range(top + 1)]) / n
    floor = max(1e-24, 1e-18 * float(np.max(residual**2, initial=0.0)))
    best, least = Noise(np.empty(0), 1.0), np.inf
    for order in range(top + 1):
        ar: np.ndarray = np.empty(0)
        if order and lags[0] > floor:
            matrix = lags[np.abs(np.subtract.outer(np.arange(order), np.arange(order)))]
            ar = np.linalg.lstsq(matrix, lags[1 : order + 1], rcond=None)[0]
        power = max(float(lags[0] - ar @ lags[1 : len(ar) + 1]), floor)
        bic = n * np.log(power) + order * np.log(n)
        if bic < least:
            white = Noise(ar, 1.0).whiten(residual)
            freedom = max(len(white) - parameters, 1)
            best, least = Noise(ar, float(np.sqrt(max(white @ white / freedom, floor)))), bic
    return best


def scatter(mean: np.ndarray) -> float:
    """Standard deviation of noise from mean to mean (n,): by third differences, which no smooth course adds to."""
    return float(np.std(np.diff(mean, 3)) / np.sqrt(20)) if len(mean) > 3 else 0.0
