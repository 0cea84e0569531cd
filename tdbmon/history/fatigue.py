"""What a drop uses up of the fatigue life of a bearing's balls: the rainflow sum of the fitted model's stresses.

`tdbsim.fatigue` counts and sums.  Each ball's Hertz pressure over the first 0.2 s after the release, which hold the hard
contacts, is counted in a simulation from the fitted values and in some drawn from what the fit does not know.  Which ball
suffers most differs from one to the next, and so does how much: the ninth power of a stress that bounces decide.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from tdbsim.fatigue import EXPONENT, STATIC_LIMIT, DropFatigue, drop_fatigue

from tdbmon.estimate import Estimate
from tdbmon.identify.model_share import FATIGUE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tdbmon.identify.calibration import Calibration

REFERENCE = 2000e6  # Pa, in cycles of which a drop is told
SECONDS = 0.2
_MEMBERS = 24


def fatigue_of(
    calibration: Calibration, drop: int = 0, seconds: float = SECONDS, members: int = _MEMBERS, seed: int = 0
) -> dict[str, Estimate]:
    """Return the fatigue of a calibrated drop an end, in cycles from nothing to `REFERENCE` of the ball that suffers most.

    Parameters
    ----------
    calibration : Calibration
    drop : int
        Its place among the calibration's drops.
    seconds : float
        After the release.
    members : int
        Simulations, the fitted one among them: their median, and in the logarithm 1.96 times their standard deviation
        with that of the model (`tdbmon.identify.model_share`).
    seed : int
        Of the draws.

    Returns
    -------
    dict
        By the end's name; missing where fewer than half of the simulations can be made.
    """
    from tdbmon.identify.draws import draws

    ends, rng = calibration.machine.ends, np.random.default_rng(seed)
    points = draws(calibration.problem, calibration.point, calibration.covariance, members, rng)
    found = [each for point in points if (each := _member(calibration, point, drop, seconds))]
    if len(found) < max(members // 2, 2):
        why = f"only {len(found)} of {members} draws from the calibration can be simulated"
        return {end: Estimate.missing("1", why) for end in ends}
    rule = (
        f"rainflow (ASTM E1049), Palmgren-Miner with exponent {EXPONENT:g}, cycles of {REFERENCE * 1e-6:.0f} MPa,"
        f" {len(found)} simulations drawn from the calibration"
    )
    return {end: _estimate([each[i] for each in found], rule, end) for i, end in enumerate(ends)}


def _estimate(members: list[DropFatigue], rule: str, end: str) -> Estimate:
    sums = np.array([each.worst for each in members])
    if np.any(sums <= 0):
        return Estimate.missing("1", f"no ball at {end} is loaded and unloaded in every simulation of the drop")
    middle, half = float(np.median(sums)), 1.96 * math.hypot(float(np.std(np.log(sums), ddof=1)), FATIGUE)
    beyond = sum(each.beyond_static_limit for each in members)
    why = (
        f"in {beyond} of {len(members)} simulations balls come above {STATIC_LIMIT * 1e-6:.0f} MPa: they may be indented,"
        " and there the sum does not hold"
    )
    return Estimate(middle, middle * math.exp(-half), middle * math.exp(half), "1", rule, why if beyond else "")


def _member(
    calibration: Calibration, point: NDArray[np.float64], drop: int, seconds: float
) -> list[DropFatigue] | None:
    """Return what the balls of each end suffer in one simulation; None where the values cannot be simulated."""
    from tdbsim.observe import observed

    from tdbmon.identify.forces import simulated
    from tdbmon.identify.stress import ball_stress

    motion = simulated(calibration.problem, point, drop, seconds)
    if motion is None:
        return None
    loads = observed(motion).loads
    bearings = enumerate(calibration.problem.model.machine.touchdown_bearings)
    return [drop_fatigue(ball_stress(b, loads[e, : b.balls.count]), REFERENCE) for e, b in bearings]
