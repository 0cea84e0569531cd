"""Contenders of made-up misfit, to judge."""

from dataclasses import replace

from tdbmon.diagnosis.suspects import suspects
from tdbmon.identify.least_squares import Fit


def contender(like, names, bic_less, ratio):
    """A contender of made-up misfit, to judge."""
    count = like.fit.count
    point, fitted = like.fit.point, like.fit
    made = Fit(point, fitted.residuals, fitted.slopes, ratio * count - bic_less)
    # of suspects with the same name, the first
    causes = {s.name: s for s in reversed(like_suspects(like)) if s.name in names}
    return replace(like, fit=made, causes=tuple(reversed(causes.values())))


def like_suspects(like):
    machine = like.problem.model.machine
    return suspects(machine, machine.probes, ())
