"""Drags that are told from each other, whole drops and noise of speed signals, for tests of the run-down."""

from __future__ import annotations

import numpy as np

from tdbmon.analysis.drag_law import DragLaw
from tdbmon.record.keyphasor import Pulses

RELEASE = 0.5  # s, in these drops

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


def one_a_turn(times: np.ndarray, sigma: float = np.nan) -> Pulses:
    return Pulses(times, np.arange(times.size), sigma, 0, 0, 0, "")


def whole_drop(seed: int, offset: float = 0.0, gain: float = 1.0) -> tuple[np.ndarray, np.ndarray, Pulses, DragLaw]:
    """Contacts brake for 0.4 s, then viscous and dry drag to standstill and rest; with the pulses of one a revolution."""
    rate, law = 2000.0, DragLaw(RELEASE + 0.4, 87.0, 1 / 4.0, 0.6)
    t = np.arange(0, 20, 1 / rate)
    braked = 100 - (100 - 87.0) * (t - RELEASE) / 0.4
    true = np.where(t < RELEASE, 100.0, np.where(t < law.start, braked, law.speed_at(t)))
    angle = np.append(0.0, np.cumsum(0.5 * (true[1:] + true[:-1]))) / rate
    marks = one_a_turn(t[np.flatnonzero(np.diff(np.floor(angle)) > 0) + 1])
    speed = gain * true + offset + np.random.default_rng(seed).normal(0, 0.05, len(t))
    return t, speed, marks, law
