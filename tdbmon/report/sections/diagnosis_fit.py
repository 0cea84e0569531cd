"""Report sections: measured against simulated motion, for the plain model and for the extended one."""

from __future__ import annotations

from functools import partial

from tdbmon.diagnosis.evidence import EXTENDED, Evidence
from tdbmon.report.document import Block, Figure, Paragraph, Section


def plain(evidence: Evidence) -> Section:
    """Return the section that compares the plain model's simulation with the readings."""
    from tdbmon.figures.measured_against_simulated import measured_against_simulated

    diagnosis = evidence.diagnosis
    drops = "all drops at once" if len(evidence.plain_left) > 1 else "the drop"
    blocks: list[Block] = [
        Paragraph(
            f"The plain model was fitted to {drops}, within the tolerances of the machine file, to"
            f" {diagnosis.plain.horizon * 1e3:.0f} ms after the release. It leaves {diagnosis.plain.times_noise} times what noise"
            " would (mean square of the whitened residuals, great ones counted less, with an allowance for how simulations"
            " with impacts grow apart). A fit spreads what a model lacks over all it may move: what is left before the first"
            " contact, too, may come from an effect that acts only later."
        ),
        Figure(
            "measured-against-plain",
            "Each probe's reading with the simulations over it, and below it what they leave, with twice the noise in grey."
            + evidence.selection,
            "For some drops and every probe, measured and simulated displacement against time, and the difference.",
            partial(measured_against_simulated, evidence.left, evidence.shown),
        ),
    ]
    return Section("Measured against the plain model", tuple(blocks))


def _drops(evidence: Evidence) -> str:
    return "drops" if len(evidence.plain_left) > 1 else "drop"


def extended(evidence: Evidence) -> Section | None:
    """Return the section that compares the extended model's simulation with the readings; None without such a model."""
    model = evidence.extended
    if model is None:
        return None
    from tdbmon.figures.measured_against_simulated import measured_against_simulated

    believed = evidence.diagnosis.verdict.believes
    what = "The likeliest model" if believed else "The best model that was found, which is not believed,"
    blocks: list[Block] = [
        Paragraph(
            f"{what} adds {model.words}. Fitted to the same {_drops(evidence)} to {model.horizon * 1e3:.0f} ms, it leaves"
            f" {model.times_noise} times what noise would."
        ),
        Figure(
            "measured-against-extended",
            "As above with the extended model alone, so that the scale of what is left is its own."
            + evidence.selection,
            "For some drops and every probe, measured and simulated displacement against time, and the difference.",
            partial(measured_against_simulated, {EXTENDED: evidence.extended_left}, evidence.shown),
        ),
    ]
    return Section("Measured against the extended model", tuple(blocks))
