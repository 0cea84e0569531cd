"""The speed at the release: that of the levitated rotor, up to the instant at which it begins to fall.

A drive may have tripped shortly before: the law is that of the last stretch which one law fits.
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

# of levitation before the release, from which the speed at the release is found; more where it is told seldom
_LEAD_S = 0.2
AGE = "how old a held speed may be"
_FEWEST = 6  # means of the speed in it
_LEAST_S = 0.005  # of levitation, without which nothing tells the speed there
_MISFIT = 4.0  # of the noise's power, left by a law of the levitated speed: no law of that stretch


def lead_of(interval: float) -> float:
    """Return how long before the release the speed is looked at, s, that is told every `interval`, s."""
    return max(_LEAD_S, (_FEWEST + 2) * interval)


def levitated_law(lead: Coast, release: float, noise: Noise | None) -> LawFit | None:
    """Return the law of the levitated speed: an exponential of either sign, over the last stretch that one fits.

    Parameters
    ----------
    lead : Coast
        Up to the release, where a driven rotor begins to coast.
    release : float
        s.
    noise : Noise or None
        None where the stretch itself must tell it.

    Returns
    -------
    LawFit or None
        None where too little levitates, or nothing turns.
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
    # the stretch is too short to show where its law changes: then the misfit is its error
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
    """Return the speed at the release (s) by the levitated law, Hz, which was sought in `lead`.

    A shaft that stands has no law: its speed is the signal's mean, of either sign, unless it holds one value as a dead one does.
    Without a `quantile` Student's is taken, since the noise was estimated from the same few spans; `source` tells of what
    signal; `bound` is the relative half-width of what is not noise; by `delay`, s, the law's times may be off either way.
    """
    if before is None and 0 < len(lead) < _FEWEST:
        told = f"the speed is told {counted(len(lead), 'time')} before the release; {_FEWEST} are needed"
        return Estimate.missing("Hz", told)
    if before is None and _levitates(lead, release) and np.ptp(lead.mean) > 0:
        mean = float(lead.mean.mean())
        if abs(mean) < STANDSTILL_HZ:
            sigma = noise_of(lead.mean - mean, 1).slow / float(np.sqrt(len(lead)))
            return Estimate.from_sigma(mean, sigma, "Hz", f"{source}, mean up to the release: the shaft stands")
    if before is None:
        return Estimate.missing("Hz", "no levitated stretch with rotation before the release")
    if quantile is None:
        quantile = float(stdtrit(max(len(before.white) - before.parameters, 1), 0.975))
    value = float(before.law.speed_at(release))
    half = float(np.hypot(quantile * before.speed_sigma(release), bound * value))
    speed = Estimate(value, value - half, value + half, "Hz", f"{source}, levitated stretch up to the release")
    return speed.widened(delay * abs(float(before.law.deceleration(value))), AGE)
