"""Decay time of a run-down, which is that of the linear term of its drag law, with its uncertainty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tdbmon.analysis.drag_law import Coast, LawFit
from tdbmon.analysis.law_choice import Candidate
from tdbmon.analysis.slip import HIDDEN, SLIPPING, is_short
from tdbmon.analysis.speed_model import term_of
from tdbmon.estimate import Z95, Estimate
from tdbmon.quantity import percent

# relative change that a nominally constant drag may have between the highest speed and rest (0.23 on the rig's records)
_STEADY = 0.5


def decay_time_of(chosen: Candidate, levitated: LawFit | None, stretch: Coast) -> Estimate:
    """Return the decay time of the chosen law.

    In a short stretch it is confounded with the drag of the bearings; the levitated run-down then bounds it.
    """
    if levitated is None and is_short(stretch):
        return Estimate.missing("s", HIDDEN)
    tau = term_of(chosen, "linear", lambda b: 1 / b, "s")
    if levitated is None or tau.low is None or tau.high is None:
        return tau
    spread = Z95 * levitated.sigma("linear")
    low, high = (1 / (levitated.law.linear + sign * spread) for sign in (1, -1))
    method = f"{tau.method}; interval extended to include the levitated run-down, as the record is short"
    return replace(tau, low=min(tau.low, low), high=max(tau.high, high), method=method)


def richer_than(candidates: list[Candidate], chosen: Candidate) -> list[LawFit]:
    """Return the fits of the laws that extend the chosen one by one term."""
    terms = set(chosen.fit.terms)
    return [c.fit for c in candidates if terms < set(c.fit.terms) and len(c.fit.terms) == len(terms) + 1]


def widened_by_law(decay: Estimate, candidates: list[Candidate], chosen: Candidate, stretch: Coast) -> Estimate:
    """Widen the interval of a decay time by the uncertainty of the drag law.

    In a long record it then covers laws with one more term, since a drag too weak to be detected still takes its share of the
    linear term, and a constant drag that changes with the speed.  In a short one, slip of the rings too slight to be detected
    may add to the drag.
    """
    if decay.value is None or decay.low is None or decay.high is None:
        return decay
    if is_short(stretch):
        method = f"{decay.method}; interval includes ring slip below {percent(SLIPPING)} of the deceleration"
        return replace(decay, high=decay.high / (1 - SLIPPING), method=method)
    law, richer = chosen.fit.law, richer_than(candidates, chosen)
    least = min([1 / decay.high, *(fit.law.linear - Z95 * fit.sigma("linear") for fit in richer)])
    unsteady = _STEADY * law.constant / law.speed
    down, up = np.hypot(1 / decay.low - law.linear, unsteady), np.hypot(law.linear - least, unsteady)
    return replace(
        decay,
        low=1 / float(law.linear + down),
        high=1 / float(max(law.linear - up, 0.01 * law.linear)),
        method=f"{decay.method}; interval includes laws with one more term and a constant drag that varies by"
        f" {percent(_STEADY)} with the speed",
    )
