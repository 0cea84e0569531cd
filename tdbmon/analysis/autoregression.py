"""Autoregressive model of the residual of a fit, and the filter that whitens it (G. U. Yule 1927)."""

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
        """Standard deviation of the white noise with the same power density at low frequency."""
        return self.sigma / max(1.0 - float(self.ar.sum()), 0.05)

    def whiten(self, x: np.ndarray) -> np.ndarray:
        """Return x (n, ...) filtered to white noise of standard deviation one, (n - p, ...)."""
        return whitened(x.T, self.ar).T[len(self.ar) :] / self.sigma


WHITE = Noise(np.empty(0), 1.0)


def whitened(values: np.ndarray, ar: np.ndarray) -> np.ndarray:
    """Return values[t] - sum ar[k] values[t - k] along the last axis; a coefficient of `ar` may differ from row to row.

    Values before the first are taken as 0.
    """
    out = values.copy()
    for lag, coefficient in enumerate(ar, start=1):
        out[..., lag:] -= coefficient * values[..., :-lag]
    return out


def noise_of(residual: np.ndarray, parameters: int) -> Noise:
    """Fit an autoregressive model to the residual (n,) of a fit with the given number of parameters.

    Uses the Yule-Walker equations; the order, at most 6, minimises the BIC.  The model is stationary for any residual, even a few
    means or mere rounding errors.  Least squares, as in `tdbmon.identify.noise`, does not ensure that, but resolves the sharp
    spectral peaks of long records, which the Yule-Walker equations flatten.
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
    """Return the standard deviation of the noise of means (n,), from third differences, to which a smooth trend adds nothing."""
    return float(np.std(np.diff(mean, 3)) / np.sqrt(20)) if len(mean) > 3 else 0.0
