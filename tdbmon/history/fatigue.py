"""Fatigue damage of a bearing's balls in a drop: rainflow sum of the stresses of the fitted model.

`tdbsim.fatigue` counts and sums.  The Hertz pressure of each ball is counted in the simulations of the forces, over the first
0.2 s after the release, which contain the hard contacts.  The most damaged ball and its damage vary between simulations, since
damage goes with the ninth power of a stress that depends on the bounces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from tdbsim.fatigue import EXPONENT, STATIC_LIMIT, DropFatigue

from tdbmon.estimate import Z95, Estimate
from tdbmon.identify.model_share import FATIGUE


def fatigue_of(members: Sequence[DropFatigue], end: str) -> Estimate:
    """Return the fatigue of a calibrated drop at an end, in cycles from 0 to 2000 MPa of the most damaged ball.

    Parameters
    ----------
    members : sequence of DropFatigue
        Of the simulations (`tdbmon.identify.forces.EndForces.fatigue`).  The estimate is their median; its interval is, in the
        logarithm, 1.96 times their standard deviation combined with that of the model (`tdbmon.identify.model_share`).
    end : str
    """
    sums = np.array([each.worst for each in members])
    if np.any(sums <= 0):
        return Estimate.missing("1", f"no ball at {end} is loaded and unloaded in every simulation of the drop")
    middle, half = float(np.median(sums)), Z95 * math.hypot(float(np.std(np.log(sums), ddof=1)), FATIGUE)
    rule = (
        f"rainflow (ASTM E1049), Palmgren-Miner with exponent {EXPONENT:g}, cycles of {members[0].reference * 1e-6:.0f} MPa,"
        f" {len(members)} simulations drawn from the calibration"
    )
    beyond = sum(each.beyond_static_limit for each in members)
    why = indented(f"in {beyond} of {len(members)} simulations balls come") if beyond else ""
    return Estimate(middle, middle * math.exp(-half), middle * math.exp(half), "1", rule, why)


def indented(where: str) -> str:
    """Return the remark on balls above the static limit, beginning with the given words."""
    return f"{where} above {STATIC_LIMIT * 1e-6:.0f} MPa: they may be indented, and the sum is not valid there"
