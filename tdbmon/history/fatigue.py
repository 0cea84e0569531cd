"""What a drop uses up of the fatigue life of a bearing's balls: the rainflow sum of the fitted model's stresses.

`tdbsim.fatigue` counts and sums.  Each ball's Hertz pressure is counted in the simulations of the forces, over the first
0.2 s after the release, which hold the hard contacts.  Which ball suffers most differs from one to the next, and so does
how much: the ninth power of a stress that bounces decide.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from tdbsim.fatigue import EXPONENT, STATIC_LIMIT, DropFatigue

from tdbmon.estimate import Z95, Estimate
from tdbmon.identify.model_share import FATIGUE


def fatigue_of(members: Sequence[DropFatigue], end: str) -> Estimate:
    """Return the fatigue of a calibrated drop at an end, in cycles from nothing to 2000 MPa of the ball that suffers most.

    Parameters
    ----------
    members : sequence of DropFatigue
        Of the simulations (`tdbmon.identify.forces.EndForces.fatigue`): their median, and in the logarithm 1.96 times their
        standard deviation with that of the model (`tdbmon.identify.model_share`).
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
    """Return what it means that balls come above the static limit, behind the words of where they do."""
    return f"{where} above {STATIC_LIMIT * 1e-6:.0f} MPa: they may be indented, and there the sum does not hold"
