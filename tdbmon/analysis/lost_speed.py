"""The speed that contacts and the spin-up of the inner rings took, beyond what the drag takes anyway."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tdbmon.analysis.drag_law import Coast, LawFit
from tdbmon.estimate import Z95, Estimate

_LAW = "speed at the release less the fitted law carried back to it"
_LEVEL = "speed at the release less the steady speed after the contacts, carried back to it"


def lost_to_level(initial: Estimate, level: LawFit, release: float) -> Estimate:
    """Return the speed lost by a rotor that turns steadily after the contacts, Hz."""
    return _lost(initial, level, release, _LEVEL)


def lost_to_law(initial: Estimate, fit: LawFit, release: float, decay: Estimate, stretch: Coast) -> Estimate:
    """Return the speed lost by a rotor that slows by a law after the contacts, Hz.

    Parameters
    ----------
    initial : Estimate
        Speed at the release, Hz.
    fit : LawFit
        To `stretch`.
    release : float
        s.
    decay : Estimate
        Its decay time, s: the interval is widened as far as this is less sure than the fit says.
    stretch : Coast
    """
    return _turned(_lost(initial, fit, release, _LAW), initial, fit, release, decay, stretch)


def _lost(initial: Estimate, fit: LawFit, release: float, method: str) -> Estimate:
    """Return the speed lost beyond a law."""
    if initial.value is None or initial.sigma is None:
        return Estimate.missing("Hz", initial.why)
    lost = initial.value - float(fit.law.speed_at(release))
    sigma = float(np.hypot(initial.sigma, fit.speed_sigma(release)))
    return Estimate.from_sigma(lost, sigma, "Hz", method)


def gained_in(lost: Estimate, begin: float) -> str:
    """Say that a rotor lost less than nothing to its contacts, s and Hz; empty where the interval reaches to nought."""
    if lost.value is None or lost.high is None or lost.high >= 0:
        return ""
    return (
        f"carried back to the release, the law that the speed follows from {begin:.3g} s on takes {-lost.value:.3g} Hz more than"
        " was lost, and contacts drive no rotor: does the drive brake, or was it still on after the release?"
    )


def _turned(
    lost: Estimate, initial: Estimate, fit: LawFit, release: float, decay: Estimate, stretch: Coast
) -> Estimate:
    """Widen a speed lost as far as the decay time is less sure than the fit says: its law may turn about its middle."""
    if lost.value is None or lost.high is None or initial.value is None:
        return lost
    if decay.value is None or not decay.low or not decay.high:
        return lost
    arm = float(0.5 * (stretch.begin[0] + stretch.end[-1]) - release) * initial.value
    own = Z95 * fit.sigma("linear")
    down, up = (
        arm * float(np.sqrt(max(turned**2 - own**2, 0.0)))
        for turned in (1 / decay.low - 1 / decay.value, 1 / decay.value - 1 / decay.high)
    )
    half = lost.high - lost.value
    return replace(lost, low=lost.value - float(np.hypot(half, down)), high=lost.value + float(np.hypot(half, up)))
