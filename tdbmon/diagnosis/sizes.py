"""The sizes of causes with their intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from tdbsim.errors import InputError

from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.effect_size import off_of, off_when_stiff
from tdbmon.estimate import Z95, Estimate
from tdbmon.identify.free_effect import FreeEffect
from tdbmon.identify.least_squares import covariance_of, linearised
from tdbmon.identify.parameters import machine_parameters
from tdbmon.identify.problem import Problem
from tdbmon.identify.rough_slopes import agreed_covariance

_RULE = "least squares of simulated against measured drops"
# relative standard deviation of a size due to inexact laws and drawings. Of 35 sizes in cases of another program, 28 intervals
# held the truth without it, 32 with it
_LAW = 0.005
_BEYOND = "at the limit of the catalogue's range; the true value may lie beyond"
_UNTOLD = "the drops do not determine it: other values of the catalogue's range fit as well"


@dataclass(frozen=True)
class Sizes:
    """Estimates of the values of a fitted model.

    Attributes
    ----------
    causes : dict
        By the name of each cause (``oval_clearance@NDE``), then of its parameters.  Those held, and those that differ from drop
        to drop, are left out.
    machine : dict
        The machine's own values to which its file gives a tolerance.
    """

    causes: dict[str, dict[str, Estimate]]
    machine: dict[str, Estimate]


def sizes_of(
    contender: Contender, without: Sequence[Mapping[str, float]] = (), rest: Mapping[str, float] | None = None
) -> Sizes:
    """Return the values of a fitted model with their intervals.

    Parameters
    ----------
    contender : Contender
    without : sequence of mapping
        Its values (SI, by name) fitted without each held-out drop: their scatter contains errors of the model, which the
        curvature of the fit does not.  Jackknife variance: n - 1 times the mean square with n drops (J. W. Tukey, Ann. Math.
        Statist. 29 (1958) 614), here over the one or two held-out drops.
    rest : mapping, optional
        Standard deviations (SI, by name) of values determined by the rest of the record and held in the fit.
    """
    problem = contender.problem
    values, _ = problem.values(contender.fit.point, 0)
    periods = {
        f"{free.name}.{of.name}": 2 * math.pi / of.harmonic
        for free in problem.free
        for of in free.declared.parameters
        if of.goes_round
    }
    sigmas = _sigmas(contender)
    for name, value in values.items():
        apart = [each[name] - value for each in without if name in each]
        if name in periods:
            apart = [math.remainder(each, periods[name]) for each in apart]
        if apart:
            times = len(problem.drops) - 1
            sigmas[name] = math.hypot(sigmas[name], math.sqrt(times * sum(each**2 for each in apart) / len(apart)))
    for name, by in (*law_errors(problem, values).items(), *(rest or {}).items()):
        sigmas[name] = math.hypot(sigmas[name], by)
    at_bound = {p.name for p, at in zip(problem.parameters, problem.at_bound(contender.fit.point), strict=True) if at}
    out: dict[str, dict[str, Estimate]] = {}
    for free in problem.free:
        each = {}
        for p in free.shared:
            value = _turned(free, p.name, values[p.name])
            least = -math.inf if p.name in periods else p.least
            known = Estimate.from_sigma(value, sigmas[p.name], p.unit, _RULE, least=least)
            if p.name in at_bound - periods.keys():
                known = Estimate(value, unit=p.unit, method=_RULE, why=_BEYOND)
            elif 2 * Z95 * sigmas[p.name] > periods.get(p.name, p.high - p.low):  # say, of a ball that carries no load
                known = Estimate(value, unit=p.unit, method=_RULE, why=_UNTOLD)
            each[p.name.rpartition(".")[2]] = known
        out[free.name] = each
    own = machine_parameters(problem.model.machine)
    return Sizes(
        out, {p.name: Estimate.from_sigma(values[p.name], sigmas[p.name], p.unit, _RULE, least=p.least) for p in own}
    )


def _sigmas(contender: Contender) -> dict[str, float]:
    """Return the standard deviations of the shared values of a fit, SI."""
    problem, point = contender.problem, contender.fit.point
    try:
        fresh = linearised(problem, point, contender.horizon)
        agreed = agreed_covariance(problem, fresh, contender.horizon)
    except InputError:
        fresh, agreed = contender.fit, np.zeros((len(point), len(point)))
    # the greater of two: autocorrelation of the residuals, and the error of a Jacobian by differences
    spread = np.sqrt(np.maximum(np.diag(covariance_of(problem, fresh, contender.horizon)), np.diag(agreed)))
    sigmas = {p.name: float(s) * p.scale for p, s in zip(problem.shared, spread, strict=False)}
    values, _ = problem.values(point, 0)
    for free in problem.free:
        if free.declared.kind.adds_to_stated:
            _add_stated(sigmas, values, problem, free)
    return sigmas


def law_errors(problem: Problem, values: Mapping[str, float]) -> dict[str, float]:
    """Return the standard deviations of causes' values due to inexact laws, SI; angles and causes of sensors are left out."""
    out = {}
    for free in problem.free:
        if free.declared.acts_on_sensors:
            continue
        for p in free.shared:
            of = free.declared.parameter(p.name.rpartition(".")[2])
            off = 0.0 if off_when_stiff(of) else off_of(of)
            if not of.goes_round:
                out[p.name] = _LAW * abs(values[p.name] - off)
    return out


def _add_stated(sigmas: dict[str, float], values: Mapping[str, float], problem: Problem, free: FreeEffect) -> None:
    """Add the tolerance of a stated vector (the machine's own unbalance) to the standard deviations of an effect that adds to it.

    Drops determine only the sum of both; a Jacobian by differences, rough where contacts begin and end, seems to separate them.
    """
    own = {p.name: p.sigma for p in problem.shared}
    amount, phase = (f"{free.name}.{of.name}" for of in free.declared.parameters[:2])
    if f"{free.where}.along" in own and amount in sigmas:
        either = max(own[f"{free.where}.along"], own[f"{free.where}.across"])
        sigmas[amount] = math.hypot(sigmas[amount], either)
        if phase in sigmas:
            sigmas[phase] = math.hypot(sigmas[phase], math.atan2(either, values[amount]))


def _turned(free: FreeEffect, name: str, value: float) -> float:
    """Return an angle reduced to within half its period of zero, other values unchanged."""
    of = free.declared.parameter(name.rpartition(".")[2])
    return math.remainder(value, 2 * math.pi / of.harmonic) if of.goes_round else value
