"""Speed at the release, extrapolated from the levitated rotor to the instant at which it begins to fall.

The drive may have tripped shortly before, so that the law is fitted to the last stretch that a single law describes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from tdbmon.analysis.autoregression import WHITE, Noise, noise_of
from tdbmon.analysis.drag_law import Coast, LawFit, fit_law
from tdbmon.analysis.law_choice import find_last_stretch
from tdbmon.estimate import Estimate
from tdbmon.quantity import counted
from tdbmon.record.speed_checks import STANDSTILL_HZ

# levitated stretch before the release from which its speed is estimated; longer if the speed is recorded rarely
_LEAD_S = 0.2
AGE = "the possible age of a held speed value"
_FEWEST = 6  # least number of mean speeds in it
_LEAST_S = 0.005  # least duration of levitation for an estimate
_MISFIT = 4.0  # residual over noise variance above which the law does not describe the levitated speed


def lead_of(interval: float) -> float:
    """Return the length of the stretch before the release for a speed that is recorded every `interval`, s."""
    return max(_LEAD_S, (_FEWEST + 2) * interval)


def levitated_law(lead: Coast, release: float, noise: Noise | None) -> LawFit | None:
    """Fit the law of the levitated speed: an exponential of either sign, over the last stretch that one describes.

    Parameters
    ----------
    lead : Coast
        Speed up to the release, where a driven rotor begins to coast.
    release : float
        s.
    noise : Noise or None
        Noise model; None if it must be estimated from the stretch itself.

    Returns
    -------
    LawFit or None
        None if the levitated stretch is too short, or the rotor does not turn.
    """
    if not _levitates(lead, release) or lead.mean.min() <= 0:
        return None
    lead = find_last_stretch(lead, noise)
    rough = fit_law(lead, ("linear",), noise or WHITE)
    if noise is None:
        return fit_law(lead, ("linear",), noise_of(rough.residual, rough.parameters), rough.law)
    power = float(rough.white @ rough.white) / max(len(rough.white) - rough.parameters, 1)
    if power < _MISFIT:
        return rough
    # the stretch is too short to show where its law changes: the misfit is taken as noise instead
    return fit_law(lead, ("linear",), replace(noise, sigma=noise.sigma * float(np.sqrt(power))), rough.law)


def _levitates(lead: Coast, release: float) -> bool:
    return len(lead) >= _FEWEST and bool(lead.begin[0] <= release - _LEAST_S)


def speed_at_release(
    before: LawFit | None,
    lead: Coast,
    release: float,
    source: str,
    quantile: float | None,
    bound: float,
    delay: float,
) -> Estimate:
    """Return the speed at the release, Hz, by the law `before` that was fitted to `lead`.

    A shaft at standstill has no law: its speed is the signal's mean, of either sign, unless the signal is constant as that of a
    dead channel.  Without a `quantile` that of Student's t is used, since the noise was estimated from the same few spans.
    `source` names the signal, `bound` is the relative half-width of the non-random error, and `delay` the timing error either
    way, s.
    """
    if before is None and 0 < len(lead) < _FEWEST:
        told = f"{counted(len(lead), 'value')} of the speed before the release; {_FEWEST} are needed"
        return Estimate.missing("Hz", told)
    if before is None and _levitates(lead, release) and np.ptp(lead.mean) > 0:
        mean = float(lead.mean.mean())
        if abs(mean) < STANDSTILL_HZ:
            sigma = noise_of(lead.mean - mean, 1).slow / float(np.sqrt(len(lead)))
            return Estimate.from_sigma(mean, sigma, "Hz", f"{source}, mean up to the release: the shaft is at standstill")
    if before is None:
        return Estimate.missing("Hz", "no levitated stretch with rotation before the release")
    if quantile is None:
        quantile = float(stdtrit(max(len(before.white) - before.parameters, 1), 0.975))
    value = float(before.law.speed_at(release))
    half = float(np.hypot(quantile * before.speed_sigma(release), bound * value))
    speed = Estimate(value, value - half, value + half, "Hz", f"{source}, levitated stretch up to the release")
    return speed.widened(delay * abs(float(before.law.deceleration(value))), AGE)
