"""The jackknife: variance of an estimate from its change when one part of the time after the other is left out.

Neighbouring samples share the noise of the same excitation, so that the covariance of a fit is too small; long parts are nearly
independent (R. G. Miller, "The jackknife - a review", Biometrika 61 (1974) 1-15).
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from tdbmon.estimate import Z95


def jackknife(left_out: np.ndarray) -> np.ndarray:
    """Return the variance of each value, given estimates (n, values) with one of n parts left out.

    Scaled by Student's quantile for few parts, so that 1.96 standard deviations are a 95 % interval.
    """
    n = len(left_out)
    quantile = float(stdtrit(n - 1, 0.975)) / Z95
    return np.asarray(quantile**2 * (n - 1) / n * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0))
