"""The jackknife: how well a value is known, by what leaving out one part of the time after the other does to it.

Neighbouring samples share the noise of the same excitation, so that a fit's own covariance is too small; long parts share
little (R. G. Miller, "The jackknife - a review", Biometrika 61 (1974) 1-15).
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from tdbmon.estimate import Z95


def jackknife(left_out: np.ndarray) -> np.ndarray:
    """Return the variance of each value (n, values) found without one part of n.

    Few parts: widened to Student's quantile, so that 1.96 standard deviations are a 95 % interval.
    """
    n = len(left_out)
    quantile = float(stdtrit(n - 1, 0.975)) / Z95
    return np.asarray(quantile**2 * (n - 1) / n * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0))
