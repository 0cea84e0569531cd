"""The sizes of causes with their intervals."""

from __future__ import annotations

import math

import numpy as np
from tdbsim.errors import InputError

from tdbmon.diagnosis.contest import Contender
from tdbmon.estimate import Estimate
from tdbmon.identify.free_effect import FreeEffect, goes_round
from tdbmon.identify.least_squares import covariance_of, linearised

_RULE = "least squares of simulated against measured drops"


def parameters(contender: Contender) -> dict[str, dict[str, Estimate]]:
    """Return the parameters of each cause by its name (``oval_clearance@NDE``) and theirs.

    Parameters that the drops share are estimated; those held, and those that differ from drop to drop, are left out.
    """
    if not contender.causes:
        return {}
    problem, point = contender.problem, contender.fit.point
    try:
        fresh = linearised(problem, point, contender.horizon)
    except InputError:
        fresh = contender.fit
    spread = np.sqrt(np.diag(covariance_of(problem, fresh, contender.horizon)))
    values, _ = problem.values(point, 0)
    index = {p.name: k for k, p in enumerate(problem.shared)}
    out: dict[str, dict[str, Estimate]] = {}
    for free in problem.free:
        each = {}
        for parameter in free.shared:
            k = index[parameter.name]
            value, sigma = _turned(free, parameter.name, values[parameter.name]), float(spread[k]) * parameter.scale
            each[parameter.name.rpartition(".")[2]] = Estimate.from_sigma(value, sigma, parameter.unit, _RULE)
        out[free.name] = each
    return out


def _turned(free: FreeEffect, name: str, value: float) -> float:
    """Return an angle within half of its period either way, other values as they are."""
    of = free.declared.parameter(name.rpartition(".")[2])
    return math.remainder(value, 2 * math.pi / of.harmonic) if goes_round(of) else value
