"""Speed lost to contacts and to the spin-up of the inner rings, in excess of the drag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tdbmon.analysis.drag_law import Coast, LawFit
from tdbmon.estimate import Z95, Estimate

_LAW = "speed at the release minus that of the fitted law extrapolated back to it"
_LEVEL = "speed at the release minus the steady speed after the contacts, extrapolated back to it"


def lost_to_level(initial: Estimate, level: LawFit, release: float) -> Estimate:
    """Return the speed lost, Hz, by a rotor that turns at a steady speed after the contacts."""
    return _lost(initial, level, release, _LEVEL)


def lost_to_law(initial: Estimate, fit: LawFit, release: float, decay: Estimate, stretch: Coast) -> Estimate:
    """Return the speed lost, Hz, by a rotor that follows a drag law after the contacts.

    Parameters
    ----------
    initial : Estimate
        Speed at the release, Hz.
    fit : LawFit
        To `stretch`.
    release : float
        Instant of the release, s.
    decay : Estimate
        Decay time of the law, s: the interval is widened if this is less certain than the fit implies.
    stretch : Coast
    """
    return _turned(_lost(initial, fit, release, _LAW), initial, fit, release, decay, stretch)


def _lost(initial: Estimate, fit: LawFit, release: float, method: str) -> Estimate:
    """Return the speed lost in excess of a law, Hz."""
    if initial.value is None or initial.sigma is None:
        return Estimate.missing("Hz", initial.why)
    lost = initial.value - float(fit.law.speed_at(release))
    sigma = float(np.hypot(initial.sigma, fit.speed_sigma(release)))
    return Estimate.from_sigma(lost, sigma, "Hz", method)


def gained_in(lost: Estimate, begin: float) -> str:
    """Return a remark if the speed lost, Hz, is surely negative, for a law that holds from `begin`, s, on; "" otherwise."""
    if lost.value is None or lost.high is None or lost.high >= 0:
        return ""
    return (
        f"the drag law fitted from {begin:.3g} s on, extrapolated back to the release, gives {-lost.value:.3g} Hz more than the"
        " speed there, but contacts cannot drive a rotor: does the drive brake, or was it still on after the release?"
    )


def _turned(
    lost: Estimate, initial: Estimate, fit: LawFit, release: float, decay: Estimate, stretch: Coast
) -> Estimate:
    """Widen the interval of a speed lost if the decay time is less certain than the fit implies.

    The law may then pivot about the middle of the fitted stretch.
    """
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
