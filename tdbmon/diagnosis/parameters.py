"""The sizes of causes with their intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import Contender
from tdbmon.estimate import Estimate
from tdbmon.identify.free_effect import FreeEffect, goes_round
from tdbmon.identify.least_squares import covariance_of, linearised
from tdbmon.identify.parameters import machine_parameters

_RULE = "least squares of simulated against measured drops"


@dataclass(frozen=True)
class Sizes:
    """What a model was fitted with.

    Attributes
    ----------
    causes : dict
        The parameters of each cause by its name (``oval_clearance@NDE``) and theirs.  Those that the drops share are
        estimated; those held, and those that differ from drop to drop, are left out.
    machine : dict
        The machine's own values, to which its file gives a tolerance.
    """

    causes: dict[str, dict[str, Estimate]]
    machine: dict[str, Estimate]


def sizes_of(contender: Contender) -> Sizes:
    """Return the values of a fitted model with their intervals."""
    problem = contender.problem
    values, _ = problem.values(contender.fit.point, 0)
    sigmas = _sigmas(contender)
    out: dict[str, dict[str, Estimate]] = {}
    for free in problem.free:
        each = {}
        for p in free.shared:
            value = _turned(free, p.name, values[p.name])
            each[p.name.rpartition(".")[2]] = Estimate.from_sigma(value, sigmas[p.name], p.unit, _RULE)
        out[free.name] = each
    own = machine_parameters(problem.model.machine)
    return Sizes(out, {p.name: Estimate.from_sigma(values[p.name], sigmas[p.name], p.unit, _RULE) for p in own})


def _sigmas(contender: Contender) -> dict[str, float]:
    """Return the standard deviations of the shared values of a fit, SI."""
    problem, point = contender.problem, contender.fit.point
    try:
        fresh = linearised(problem, point, contender.horizon)
    except InputError:
        fresh = contender.fit
    spread = np.sqrt(np.diag(covariance_of(problem, fresh, contender.horizon)))
    return {p.name: float(s) * p.scale for p, s in zip(problem.shared, spread, strict=False)}


def _turned(free: FreeEffect, name: str, value: float) -> float:
    """Return an angle within half of its period either way, other values as they are."""
    of = free.declared.parameter(name.rpartition(".")[2])
    return math.remainder(value, 2 * math.pi / of.harmonic) if goes_round(of) else value
