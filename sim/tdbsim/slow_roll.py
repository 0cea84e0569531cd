"""Slow roll: the 1X reading of a shaft that does not whirl, as stated in the machine file."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tdbsim.machine import Probe

Array = NDArray[np.float64]


def slow_roll(probe: Probe, turned: Array) -> Array:
    """Return the slow roll reading of a probe, m, 0 where none is stated.

    ``peak_to_peak / 2 cos(turned - phase_lag)``: the greatest reading comes when the shaft has turned by the phase lag.

    Parameters
    ----------
    probe : Probe
    turned : (...,) array
        Angle turned by the shaft since the keyphasor's edge, in its sense of rotation, rad; NaN where unknown.
    """
    stated = probe.slow_roll
    if stated is None:
        return np.zeros_like(turned)
    return stated.peak_to_peak / 2 * np.cos(turned - stated.phase_lag)
