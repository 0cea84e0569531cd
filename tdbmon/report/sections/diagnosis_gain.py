"""Report section: the gain of the extended model on a held-out drop (cross-validation)."""

from __future__ import annotations

from functools import partial

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.held_out import HeldOut, Judge
from tdbmon.quantity import percent
from tdbmon.report.document import Block, Figure, Paragraph, Row, Section, Table, Tone, Verdict


def section(evidence: Evidence) -> Section | None:
    """Return the section on the held-out gain; None if no model with a cause completed the search."""
    diagnosis = evidence.diagnosis
    if all(not each.causes for each in diagnosis.contenders):
        return None
    title = "Gain on a held-out drop"
    proof = diagnosis.proof
    if proof is None:
        return Section(title, (Paragraph("No drop could be held out, so no gain is proved."),))
    from tdbmon.figures.extended_gain import extended_gain

    believed = diagnosis.verdict.believes
    tone: Tone = "attention" if not believed else "good" if diagnosis.verdict.doubt is None else "plain"
    if proof.gain is None:
        said = Verdict(f"The residual of the plain model is hardly more than noise there: {_beside_readings(proof)}.")
    elif proof.gain < 0:
        said = Verdict("The extended model does worse there than the plain one.", "attention")
    else:
        said = Verdict(
            f"The extended model removes {percent(proof.gain, 1)} of the plain model's residual beyond the noise there."
            + ("" if believed else " The verdict says why it is not accepted all the same.")
            + ("" if diagnosis.verdict.doubt is None else " The verdict says how certain it is."),
            tone,
        )
    without = proof.drop if len(proof.drops) == 1 else f"each of {proof.drop} in turn"
    how = {
        Judge.READINGS: f"Both models were fitted again without {without}. For that drop only its own values were then"
        " fitted: position and velocity at the release, shaft and cage angles, offsets of the probes. Machine and effect are"
        " those of the other drops.",
        Judge.ARC: f"For {proof.drop}, each in turn, the effect's size and the factor of the simulated lag are those of the"
        " other drops. The residual of the shaft's angle is given as the arc that the journal has turned.",
        Judge.REST: f"For {proof.drop}, each in turn, the effect's values are those with which the rest of the other drops'"
        " records agrees best with its simulations. The residual is measured less simulated, averaged over the rest of the"
        " record: the shaft's position at each probe, and its 1X whirl. The noise is the scatter of the"
        f" simulations. The sum of squared deviations of all drops is {proof.plain_misfit:.1f} without the"
        f" effect and {proof.extended_misfit:.1f} with it.",
    }
    blocks: list[Block] = [
        Paragraph(how[proof.judge]),
        said,
        Figure(
            "extended-gain",
            f"Residual of the {proof.judge} with each model.",
            "Three bars: residual of the plain model, residual of the extended model, and the noise.",
            partial(extended_gain, proof),
        ),
    ]
    if proof.each:
        blocks.append(_table(proof))
    return Section(title, tuple(blocks))


def _beside_readings(proof: HeldOut) -> str:
    """Return the evidence for a cause when the readings leave hardly any misfit to reduce."""
    if proof.clear_in_each:
        return "the readings hardly show a gain; all data of each drop together do, by the share in the last column below"
    return "means over all drops hardly show a gain" if proof.seen else "no gain is possible"


def _table(proof: HeldOut) -> Table:
    """Return a table of the residuals of each of several held-out drops."""
    header = ("Held-out drop", "Plain [µm rms]", "Extended [µm rms]", "Noise [µm rms]", "Less misfit")
    rows = (
        Row(
            (
                each.drop,
                *(f"{value * 1e6:.3f}" for value in (each.plain, each.extended, each.noise)),
                percent(each.takes, 1),
            )
        )
        for each in proof.each
    )
    caption = (
        "Each drop held out in turn. The misfit is the sum of squares in units of the noise, noise included; it also"
        " contains the speed and the levitated stretch"
    )
    return Table(caption, header, tuple(rows))
