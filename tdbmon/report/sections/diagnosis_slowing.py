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
        f" A drive holds the speed up to the release, so that nothing before it tells the drag: within the tolerance of the"
        f" decay time it counts {drags}."
        if drags
        else ""
    )
    machine = evidence.diagnosis.plain.problem.model.machine
    last = models[list(models)[-1]][1]
    beside, _ = lag_beside_drag(last, machine)
    torques = torques_beside_lag(last, evidence.extended or evidence.diagnosis.plain)
    more = (
        f", and {beside:.2f} times where the drag may be off by its tolerance as well. What is left of the angle then, drawn"
        " below, tells of rings that are hard to turn."
        if torques is None
        else f". That does not explain it: {torque_in_words(torques, machine)}."
    )
    names = [drop.name for drop in evidence.diagnosis.plain.problem.drops]
    return Section(
        "How the rotor slows",
        (
            Paragraph(
                "Where the shaft is in its gap can be simulated only until paths with impacts part; how far it has turned, to the"
                " end of the record: friction takes as much speed away however the impacts fall, until the inner rings turn with"
                " the shaft. Polar inertia and friction at small loads are not known well, so that the angle by which contacts"
                f" hold the shaft back is taken as large as the record wants it: {counted} what is simulated{more}{untold}"
            ),
            Figure(
                "slowing",
                "Shaft angle, measured less simulated, from where paths have parted to the end of the record."
                + evidence.selection,
                "For some drops, the angle by which the measured shaft is ahead of the simulated one, against time.",
                partial(slowing, models, names, evidence.shown),
            ),
        ),
    )
