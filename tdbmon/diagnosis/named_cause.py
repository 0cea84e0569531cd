"""The causes that a diagnosis names, each with its place, probability and sizes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.suspects import Suspect
from tdbmon.estimate import Estimate

_NOT_FITTED = "not fitted: it looks like another cause that is named"


@dataclass(frozen=True)
class NamedCause:
    """An effect of the catalogue that a diagnosis names.

    Attributes
    ----------
    effect : str
        Its identifier.
    where : str
    probability : float
        Sum over all accused models that contain it.
    parameters : mapping
        Estimates by parameter name.
    held : mapping
        Words and numbers that were tried, not fitted, by name.
    """

    effect: str
    where: str
    probability: float
    parameters: Mapping[str, Estimate]
    held: Mapping[str, float | str]


def named_causes(diagnosis: Diagnosis) -> list[NamedCause]:
    """Return the causes of all accused models and of their look-alikes, the likeliest first."""
    found: dict[str, NamedCause] = {}
    by_contender = dict(zip(diagnosis.contenders, diagnosis.verdict.probabilities, strict=True))
    for contender in diagnosis.verdict.accused:
        sizes = diagnosis.parameters.get(contender, {})
        for cause, free in zip(contender.causes, contender.problem.free, strict=True):
            words = {k: v for k, v in free.held.items() if not cause.declared.parameter(k).held}
            _add(found, cause, by_contender.get(contender, 0.0), sizes.get(cause.name, {}), words)
    for model in diagnosis.verdict.alike:
        for cause in model.causes:
            unknown = {p.name: Estimate.missing(p.unit, _NOT_FITTED) for p, _ in cause.sizes}
            _add(found, cause, model.probability, unknown, {})
    return sorted(found.values(), key=lambda each: -each.probability)


def _add(
    found: dict[str, NamedCause],
    cause: Suspect,
    probability: float,
    parameters: Mapping[str, Estimate],
    held: Mapping[str, float | str],
) -> None:
    """Add a model's cause, or only its probability if a likelier model has that cause too."""
    known = found.get(cause.name)
    if known is not None:
        found[cause.name] = replace(known, probability=known.probability + probability)
    else:
        found[cause.name] = NamedCause(cause.declared.identifier, cause.where, probability, parameters, held)
