"""The force that the plain model lacks at the ends, as the record shows it."""

from __future__ import annotations

from functools import partial

import numpy as np
from tdbsim.columns import GAP

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.residual_force import STEP_S
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table


def section(evidence: Evidence) -> Section:
    """Return the missing force against time, position and angle."""
    from tdbmon.figures.residual_force import force_against_place, force_against_time

    ends = evidence.diagnosis.machine.ends
    forces = evidence.plain_force
    speeds = [left.speed for left in evidence.plain_left]
    shown = evidence.shown
    gaps = evidence.plain_left[0].motion.model.arrays.end[:, GAP].tolist()
    blocks: list[Block] = [
        Paragraph(
            "The force at the two bearing planes that, put onto the rotor of the plain model beside the forces of its"
            " simulation, makes it follow the record: found from what the plain model leaves, by the rotor's own equations"
            f" (rigid and bending modes, gyroscopic), at instants {STEP_S * 1e3:.1f} ms apart. How fast it may change is the"
            " likeliest for the record; the band is what the probes' noise leaves open. Its limits: what happens within less"
            " than that time is smeared; a force elsewhere on the rotor shows as its shares at the two ends; and after the"
            " first contact a simulation that merely bounces elsewhere makes a force too, at the contacts, where the one of"
            " the simulation is late, early or turned."
        ),
        Figure(
            "residual-force-time",
            "Missing force against time. Shaded: where the plain simulation is in contact. A force in the flight acts without"
            " contact; one in a contact says that gap, stiffness, damping or friction act otherwise than in the model.",
            "For each end, x and y of the missing force against time, with band, for some drops side by side.",
            partial(force_against_time, [forces[k] for k in shown], ends, [speeds[k] for k in shown], "plain model"),
        ),
        Figure(
            "residual-force-place",
            "Missing force where the shaft stood. Left: arrows on the path of the shaft centre, with the fitted radial gap"
            " dashed. Right: its parts away from the bearing's centre and counter-clockwise, against the angle: a cause that"
            " is fixed to the bearing gives all drops the same course there.",
            "For each end, arrows in the clearance circle, and radial and tangential force against angle.",
            partial(force_against_place, forces, ends, gaps, speeds),
        ),
        table(evidence),
    ]
    return Section("The force that is missing", tuple(blocks))


def table(evidence: Evidence) -> Table:
    """Return the greatest missing force of each drop and end, by the plain and the extended model."""
    models = [("plain", evidence.plain_force)]
    if evidence.extended is not None:
        models.append(("extended", evidence.extended_force))
    rows = []
    for k, plain in enumerate(evidence.plain_force):
        for e, end in enumerate(evidence.diagnosis.machine.ends):
            cells = []
            for _, forces in models:
                each = forces[k]
                cells += [_greatest(each.force[e], each.band[e]), f"{each.stands_out[e] * 100:.0f} %"]
            cells.append(f"{np.abs(plain.simulated[e]).max():.0f} N")
            rows.append(Row((plain.drop, end, *cells)))
    heads = [head for name, _ in models for head in (f"Greatest, {name}", f"Out of band, {name}")]
    header = ("Drop", "End", *heads, "Contact force, plain")
    return Table("Missing force (with its 95 % band) and how much of the time it is out of it", header, tuple(rows))


def _greatest(force: np.ndarray, band: np.ndarray) -> str:
    at = int(np.argmax(np.abs(force)))
    return f"{abs(force[at]):.0f} ± {float(np.hypot(*band[:, at]) / np.sqrt(2)):.0f} N"
