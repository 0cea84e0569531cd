"""The decay time of a run-down: that of its law's linear term, as far as the record lets it be known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tdbmon.analysis.drag_law import Coast, LawFit
from tdbmon.analysis.law_choice import Candidate
from tdbmon.analysis.slip import HIDDEN, SLIPPING, is_short
from tdbmon.analysis.speed_model import term_of
from tdbmon.estimate import Z95, Estimate
from tdbmon.quantity import percent

# of a constant drag: so much of it may come or go from the fastest speed to rest (0.23 on the rig's records)
_STEADY = 0.5


def decay_time_of(chosen: Candidate, levitated: LawFit | None, stretch: Coast) -> Estimate:
    """The chosen law's; in a short stretch the drag of the bearings hides in it, and levitation bounds what it hides."""
    if levitated is None and is_short(stretch):
        return Estimate.missing("s", HIDDEN)
    tau = term_of(chosen, "linear", lambda b: 1 / b, "s")
    if levitated is None or tau.low is None or tau.high is None:
        return tau
    spread = Z95 * levitated.sigma("linear")
    low, high = (1 / (levitated.law.linear + sign * spread) for sign in (1, -1))
    method = f"{tau.method}; interval widened to the levitated run-down, as the record is short"
    return replace(tau, low=min(tau.low, low), high=max(tau.high, high), method=method)


def richer_than(candidates: list[Candidate], chosen: Candidate) -> list[LawFit]:
    """Return the fits of the laws that have one term more than the chosen one."""
    terms = set(chosen.fit.terms)
    return [c.fit for c in candidates if terms < set(c.fit.terms) and len(c.fit.terms) == len(terms) + 1]


def widened_by_law(decay: Estimate, candidates: list[Candidate], chosen: Candidate, stretch: Coast) -> Estimate:
    """Widen the interval of a decay time by what is not known of the law.

    In a long record to what laws of one term more leave possible, since a drag that is too weak to be told takes its share of
    the linear term all the same, and by a constant drag that is not quite constant.  In a short one rings that slip so little
    that it passes for coasting may add to the drag.
    """
    if decay.value is None or decay.low is None or decay.high is None:
        return decay
    if is_short(stretch):
        method = f"{decay.method}, and by slip below {percent(SLIPPING)} of the deceleration"
        return replace(decay, high=decay.high / (1 - SLIPPING), method=method)
    law, richer = chosen.fit.law, richer_than(candidates, chosen)
    least = min([1 / decay.high, *(fit.law.linear - Z95 * fit.sigma("linear") for fit in richer)])
    unsteady = _STEADY * law.constant / law.speed
    down, up = np.hypot(1 / decay.low - law.linear, unsteady), np.hypot(law.linear - least, unsteady)
    return replace(
        decay,
        low=1 / float(law.linear + down),
        high=1 / float(max(law.linear - up, 0.01 * law.linear)),
        method=f"{decay.method}; interval with richer laws and a constant drag that changes by {percent(_STEADY)} with the speed",
    )
