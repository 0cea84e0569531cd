"""A law of drag that was tried on a run-down, as it is published: its terms with their intervals, and how well it fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tdbmon.analysis.law_choice import Candidate
from tdbmon.estimate import Z95, Estimate


@dataclass(frozen=True)
class SpeedModel:
    """A candidate law, fitted.

    Attributes
    ----------
    name : str
        One of `law_choice.MODELS`.
    parameters : dict of Estimate
        ``decay_time_s``, ``constant_drag_hz_per_s``, ``quadratic_loss_per_revolution`` (share of the speed lost a
        revolution), those that the law has.
    rms, held_out_rms : float
        Misfit of the mean speed over blocks (or turns), Hz, and the same on stretches that took no part in the fit.
    bic : float
        On whitened residuals.
    chosen : bool
        True for the one that the other results rest on.
    refused : str
        Why it cannot be chosen; empty where it can.
    """

    name: str
    parameters: dict[str, Estimate]
    rms: float
    bic: float
    held_out_rms: float
    chosen: bool
    refused: str = ""


def speed_model(candidate: Candidate, chosen: bool) -> SpeedModel:
    """State a candidate's parameters with their intervals and units."""
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
    """Return a positive term, or what follows from it, with an interval that is symmetric in its logarithm."""
    if term not in candidate.fit.terms:
        return Estimate.missing(unit, f"the chosen law ({candidate.name}) has no {term} term")
    value = float(getattr(candidate.fit.law, term))
    if value <= 0:
        return Estimate.missing(unit, candidate.refused)
    factor = float(np.exp(min(Z95 * candidate.fit.sigma(term) / value, 50.0)))
    low, high = sorted((of(value / factor), of(value * factor)))
    return Estimate(of(value), low, high, unit, f"{candidate.name} law, least squares on whitened residuals")
