"""Report section: the residual force at each end that the plain model lacks, estimated from the record."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from tdbsim.columns import GAP

from tdbmon.diagnosis.evidence import PLAIN, Evidence
from tdbmon.diagnosis.residual_force import STEP_S, ResidualForce, Summary
from tdbmon.quantity import percent, whole_degrees
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table

_STRAIGHT = 0.5  # least straightness of a force that acts along one line
_ONE_SIDED = 0.7  # least mean, relative to the rms, of a force with one direction


def section(evidence: Evidence) -> Section:
    """Return the section on the residual force against time, position and angle."""
    from tdbmon.figures.residual_force import force_against_place, force_against_time

    ends = evidence.diagnosis.machine.ends
    forces = evidence.plain_force
    speeds = [left.speed for left in evidence.plain_left]
    shown = evidence.shown
    gaps = evidence.plain_left[0].motion.model.arrays.end[:, GAP].tolist()
    blocks: list[Block] = [
        Paragraph(
            "The force at the two bearing planes that makes the rotor of the plain model follow the record if it acts in"
            " addition to the simulated forces. It is computed from the residual of the plain model by the rotor's equations of"
            f" motion (rigid and bending modes, gyroscopic), at instants {STEP_S * 1e3:.1f} ms apart. How fast it may change is"
            " the likeliest for the record; the band is the uncertainty by the probes' noise. Limits: changes within less than"
            " that time are smoothed; a force elsewhere on the rotor appears as its shares at the two ends; and after the first"
            " contact a simulation that only bounces differently gives a force too, at the contacts, where the simulated force"
            " is late, early or turned."
        ),
        Figure(
            "residual-force-time",
            "Missing force against time. Shaded: where the plain simulation is in contact. A force during flight acts without"
            " contact; one during a contact shows that gap, stiffness, damping or friction differ from the model."
            + evidence.selection,
            "For each end, x and y of the missing force against time, with band, for some drops side by side.",
            partial(force_against_time, [forces[k] for k in shown], ends, [speeds[k] for k in shown], PLAIN),
        ),
        Figure(
            "residual-force-place",
            "Missing force at the position of the shaft. Left: arrows on the path of the shaft centre, with the fitted radial"
            " gap dashed. Right: its radial (outward) and tangential (counter-clockwise) parts against the angle: a cause that"
            " is fixed to the bearing gives the same curve in all drops.",
            "For each end, arrows in the clearance circle, and radial and tangential force against angle.",
            partial(force_against_place, forces, ends, gaps, speeds),
        ),
        table(PLAIN, forces, ends),
    ]
    return Section("The force that is missing", tuple(blocks))


def table(model: str, drops: Sequence[ResidualForce], ends: Sequence[str]) -> Table:
    """Return a table of the residual force of each drop and end, before the first contact and after it, with its direction."""
    rows = []
    for each in drops:
        for e, end in enumerate(ends):
            cells = []
            for within in (each.fall, ~each.fall):
                found = each.summary(e, within)
                cells += ["–", "–"] if found is None else [f"{found.rms:.0f} N (± {found.band:.0f})", _along(found)]
            out = percent(each.stands_out[e])
            rows.append(Row((each.drop, end, *cells, out, f"{np.abs(each.simulated[e]).max():.0f} N")))
    header = ("Drop", "End", "While falling, rms", "Along", "Later, rms", "Along", "Outside band", "Contact force, peak")
    caption = (
        f"Force that the {model} lacks, with its 95 % band (angles from +x towards +y), how much of the time it is outside"
        " the band, and for comparison the greatest contact force of the simulation"
    )
    return Table(caption, header, tuple(rows))


def _along(found: Summary) -> str:
    """Return the direction of the force as text, if it exceeds its confidence band and has a direction."""
    if found.rms < found.band:
        return "rms within band"
    if found.straight < _STRAIGHT:
        return "no direction"
    if abs(found.mean) > _ONE_SIDED * found.rms:
        return f"to {whole_degrees(float(np.angle(found.mean)))}"
    return f"to and fro, {whole_degrees(found.axis)}"
