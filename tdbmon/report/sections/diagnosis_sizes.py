"""Report section: the fitted values of the named causes with their intervals and correlations."""

from __future__ import annotations

import numpy as np

from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.evidence import Evidence
from tdbmon.estimate import Estimate
from tdbmon.identify.free_effect import FreeEffect
from tdbmon.identify.least_squares import information
from tdbmon.quantity import capitalised, signed, words
from tdbmon.report.document import Block, Paragraph, Row, Section, Table

_PARTNER = 0.5  # least correlation at which another value is listed
_PARTNERS = 3


def section(evidence: Evidence) -> Section | None:
    """Return a table for each model named by the verdict, else for the best, rejected one; None if there is neither."""
    diagnosis = evidence.diagnosis
    models = diagnosis.verdict.accused or ((evidence.extended,) if evidence.extended is not None else ())
    if not models:
        return None
    blocks: list[Block] = []
    if not diagnosis.verdict.accused:
        blocks.append(
            Paragraph("The best model found is not accepted. Its values only show where its fit ended.")
        )
    blocks += [_table(model, diagnosis.parameters.get(model, {}), many=len(models) > 1) for model in models]
    blocks.append(
        Paragraph(
            "Correlated: values of machine and sensors that the drops can hardly separate from this one; if they were known"
            " better, its interval would shrink. The sign shows whether both rise together (+) or one falls as the other rises"
            " (−)."
        )
    )
    title = "Sizes of the causes" if diagnosis.verdict.accused else "Values of the best model, which is not accepted"
    return Section(title, tuple(blocks))


def _table(model: Contender, known: dict[str, dict[str, Estimate]], many: bool) -> Table:
    partners = correlated(model)
    called = {each.name: _called(each.name) for each in model.problem.shared}
    called |= {each.name: _called(each.name, free.words) for free in model.problem.free for each in free.shared}
    rows = []
    for free in model.problem.free:
        found = known.get(free.name, {})
        owner = free.words
        for parameter in free.shared:
            name = parameter.name.rpartition(".")[2]
            diagnosed = name in found
            estimate = found.get(name) or _bare(model, parameter.name, parameter.unit)
            with_ = ", ".join(f"{called[other]} ({signed(r, 2)})" for other, r in partners.get(parameter.name, ()))
            value = words(estimate) + (f" ({estimate.why})" if estimate.why and diagnosed else "")
            rows.append(Row((called[parameter.name], value, with_ or "–")))
        rows += [Row((f"{owner}: {name}", text, "not fitted")) for name, text in _stays(free)]
        if free.each_start:
            names = ", ".join(name.replace("_", " ") for name in free.each_start[0])
            rows.append(Row((f"{owner}: {names}", "fitted to each drop separately", "–")))
    words_ = "; ".join(cause.tried_with for cause in model.causes if cause.held)
    which = f"{capitalised(model.words)}{f' ({words_})' if words_ else ''}"
    caption = f"{which}: values with 95 % intervals" if many else "Values with 95 % intervals"
    return Table(caption, ("Value", "Fitted", "Correlated with"), tuple(rows))


def _called(name: str, owner: str | None = None) -> str:
    """Return the readable name of a value: ``NDE: support stiffness`` for ``NDE.support_stiffness``."""
    stated, _, value = name.rpartition(".")
    return f"{owner or stated}: {value.replace('_', ' ')}".removeprefix(": ")


def _bare(model: Contender, name: str, unit: str) -> Estimate:
    shared, _ = model.problem.values(model.fit.point, 0)
    return Estimate(shared[name], unit=unit, why="no interval: the model is not accepted")


def _stays(free: FreeEffect) -> list[tuple[str, str]]:
    held = [(name.replace("_", " "), free.declared.parameter(name).text(value)) for name, value in free.held.items()]
    if free.each_held:
        for name in free.each_held[0]:
            held.append((name.replace("_", " "), "by drop: " + ", ".join(f"{each[name]:g}" for each in free.each_held)))
    return held


def correlated(model: Contender) -> dict[str, list[tuple[str, float]]]:
    """Return the values correlated with each value of the causes, from the Fisher information at the end of the fit."""
    problem = model.problem
    covariance = np.linalg.inv(information(problem, model.fit))
    spread = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(spread, spread)
    names = [parameter.name for parameter in problem.shared]
    free = {parameter.name for each in problem.free for parameter in each.shared}
    out = {}
    for i, name in enumerate(names):
        if name in free:
            order = [k for k in np.argsort(-np.abs(correlation[i, : len(names)])) if k != i][:_PARTNERS]
            out[name] = [(names[k], float(correlation[i, k])) for k in order if abs(correlation[i, k]) > _PARTNER]
    return out
