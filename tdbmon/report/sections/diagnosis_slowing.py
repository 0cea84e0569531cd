"""Report section: deceleration of the rotor after measured and simulated trajectories have diverged."""

from __future__ import annotations

from functools import partial

from tdbmon.diagnosis.evidence import EXTENDED, PLAIN, Evidence
from tdbmon.diagnosis.slows_otherwise import lag_beside_drag, torque_in_words, torques_beside_lag
from tdbmon.identify.slowing import factors_of
from tdbmon.report.document import Figure, Paragraph, Section


def section(evidence: Evidence) -> Section | None:
    """Return the section on the shaft angle, measured minus simulated; None without a keyphasor."""
    if evidence.plain_slowing is None:
        return None
    from tdbmon.figures.slowing import slowing

    models = {PLAIN: (factors_of(evidence.plain_slowing), evidence.plain_slowing)}
    if evidence.extended_slowing is not None:
        models[EXTENDED] = (factors_of(evidence.extended_slowing), evidence.extended_slowing)
    counted = " and ".join(f"{factors.lag:.2f} times ({name})" for name, (factors, _) in models.items())
    drags = " and ".join(
        f"{factors.drag:.2f} times ({name})" for name, (factors, _) in models.items() if factors.drag != 1.0
    )
    untold = (
        f" A drive holds the speed up to the release, so the drag is not seen before it: within the tolerance of the"
        f" decay time it is fitted as {drags}."
        if drags
        else ""
    )
    machine = evidence.diagnosis.plain.problem.model.machine
    last = models[list(models)[-1]][1]
    beside, _ = lag_beside_drag(last, machine)
    torques = torques_beside_lag(last, evidence.extended or evidence.diagnosis.plain)
    more = (
        f", and {beside:.2f} times if the drag may also differ by its tolerance. The remaining residual of the angle, drawn"
        " below, would show rings that are hard to turn."
        if torques is None
        else f". That does not explain it: {torque_in_words(torques, machine)}."
    )
    names = [drop.name for drop in evidence.diagnosis.plain.problem.drops]
    return Section(
        "How the rotor slows",
        (
            Paragraph(
                "The shaft's position in its gap can be simulated only until paths with impacts diverge; its angle, to the end"
                " of the record: the speed lost to friction does not depend on when the impacts happen, until the inner rings"
                " turn with the shaft. Polar inertia and friction at small loads are not known well, so the lag of the angle by"
                f" contacts is scaled to fit the record: {counted} the simulated lag{more}{untold}"
            ),
            Figure(
                "slowing",
                "Shaft angle, measured less simulated, from where paths have diverged to the end of the record."
                + evidence.selection,
                "For some drops, the angle by which the measured shaft is ahead of the simulated one, against time.",
                partial(slowing, models, names, evidence.shown),
            ),
        ),
    )
