"""The machine file of an extended model, accepted by every other command."""

from __future__ import annotations

from tdbsim.machine import Machine

from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.identify.parameters import calibrated_machine
from tdbmon.machine_file import with_effects
from tdbmon.quantity import percent


def extended_machine(diagnosis: Diagnosis) -> Machine | None:
    """Return the machine with the values and effects of the likeliest extended model; None if none is accused.

    Values that differ from drop to drop (a phase on the inner ring, the number of a ball) are those of the first drop.
    """
    if not diagnosis.verdict.believes or not diagnosis.verdict.accused:
        return None
    best = diagnosis.verdict.accused[0]
    shared, own = best.problem.values(best.fit.point, 0)
    effects = [each.at(shared, own, 0) for each in best.problem.free]
    return with_effects(calibrated_machine(diagnosis.machine, shared), effects)


def extended_head(diagnosis: Diagnosis) -> str:
    """Return the comment at the head of the file."""
    names = ", ".join(drop.name for drop in diagnosis.plain.problem.drops)
    lines = [f"{diagnosis.machine.name}: values and effects as tdbmon diagnose found them in {names}"]
    lines.append(f"verdict: {diagnosis.verdict.kind} - {diagnosis.verdict.why}")
    if diagnosis.proof is not None and diagnosis.proof.gain is not None:
        lines.append(f"gain on {diagnosis.proof.named}: {percent(diagnosis.proof.gain, 1)}")
    if own := [each.words for each in diagnosis.verdict.accused[0].problem.free if each.of_each_drop]:
        first = diagnosis.plain.problem.drops[0].name
        lines.append(f"angles and numbers that differ from drop to drop are those of {first}: {', '.join(own)}")
    return "\n".join(lines)
