"""Drags that are told from each other, and noise of speed signals, for tests of the run-down."""

from __future__ import annotations

import numpy as np

STRONG = {
    "exponential": {"linear": 1 / 5.0},
    "exponential + constant": {"linear": 1 / 8.0, "constant": 1.5},
    "exponential + quadratic": {"linear": 1 / 12.0, "quadratic": 2e-3},
    "constant + exponential + quadratic": {"linear": 1 / 6.0, "constant": 2.0, "quadratic": 3e-3},
    "constant": {"constant": 6.0},
    "quadratic": {"quadratic": 3e-3},
}
NAMES = {
    "linear": ("decay_time_s", lambda b: 1 / b),
    "constant": ("constant_drag_hz_per_s", lambda a: a),
    "quadratic": ("quadratic_loss_per_revolution", lambda q: q),
}


def coloured(rng: np.random.Generator, n: int, sigma: float, rho: float) -> np.ndarray:
    """Stationary AR(1) noise of standard deviation sigma."""
    kicks = rng.normal(0, sigma * np.sqrt(1 - rho**2), n)
    out = np.empty(n)
    out[0] = rng.normal(0, sigma)
    for i in range(1, n):
        out[i] = rho * out[i - 1] + kicks[i]
    return out
