"""Drag laws fitted to a run-down, as they are published: parameters with confidence intervals, and goodness of fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tdbmon.analysis.law_choice import Candidate
from tdbmon.estimate import Z95, Estimate


@dataclass(frozen=True)
class SpeedModel:
    """A fitted candidate law.

    Attributes
    ----------
    name : str
        One of `law_choice.MODELS`.
    parameters : dict of Estimate
        ``decay_time_s``, ``constant_drag_hz_per_s``, ``quadratic_loss_per_revolution`` (share of the speed lost per
        revolution), as far as the law has them.
    rms, held_out_rms : float
        Rms residual of the mean speed over blocks (or revolutions), Hz, and the same in cross-validation.
    bic : float
        Bayesian information criterion of the whitened residuals.
    chosen : bool
        True for the law on which the other results are based.
    refused : str
        Why it cannot be chosen; empty if it can.
    """

    name: str
    parameters: dict[str, Estimate]
    rms: float
    bic: float
    held_out_rms: float
    chosen: bool
    refused: str = ""


def speed_model(candidate: Candidate, chosen: bool) -> SpeedModel:
    """Return the published form of a candidate: parameters with their intervals and units, and goodness of fit."""
    makers: dict[str, tuple[str, Callable[[float], float], str]] = {
        "linear": ("decay_time_s", lambda b: 1 / b, "s"),
        "constant": ("constant_drag_hz_per_s", lambda a: a, "Hz/s"),
        "quadratic": ("quadratic_loss_per_revolution", lambda q: q, "1"),
    }
    parameters = {}
    for term in candidate.fit.terms:
        name, of, unit = makers[term]
        parameters[name] = term_of(candidate, term, of, unit)
    rms = candidate.rms
    apart = float(np.sqrt(candidate.held_out / max(candidate.power, 1e-300)))
    return SpeedModel(candidate.name, parameters, rms, candidate.fit.bic, rms * apart, chosen, candidate.refused)


def term_of(candidate: Candidate, term: str, of: Callable[[float], float], unit: str) -> Estimate:
    """Return a function `of` a positive coefficient, with an interval that is symmetric in the logarithm."""
    if term not in candidate.fit.terms:
        return Estimate.missing(unit, f"the chosen law ({candidate.name}) has no {term} term")
    value = float(getattr(candidate.fit.law, term))
    if value <= 0:
        return Estimate.missing(unit, candidate.refused)
    factor = float(np.exp(min(Z95 * candidate.fit.sigma(term) / value, 50.0)))
    low, high = sorted((of(value / factor), of(value * factor)))
    return Estimate(of(value), low, high, unit, f"{candidate.name} law, least squares on whitened residuals")
