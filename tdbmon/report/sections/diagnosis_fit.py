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
            f" {diagnosis.plain.horizon * 1e3:.0f} ms after the release. Its misfit is {diagnosis.plain.times_noise} times that"
            " of noise alone (mean square of the whitened residuals, large ones weighted less, with an allowance for how"
            " simulations with impacts diverge). A fit spreads what a model lacks over all values that it may change: even a"
            " residual before the first contact may come from an effect that acts only later."
        ),
        Figure(
            "measured-against-plain",
            "Each probe's reading with the simulations over it, and below it the residuals, with twice the noise in grey."
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
    what = "The likeliest model" if believed else "The best model found, which is not accepted,"
    blocks: list[Block] = [
        Paragraph(
            f"{what} adds {model.words}. Fitted to the same {_drops(evidence)} to {model.horizon * 1e3:.0f} ms, its misfit"
            f" is {model.times_noise} times that of noise alone."
        ),
        Figure(
            "measured-against-extended",
            "As above, with the extended model only, so that its residual has its own scale."
            + evidence.selection,
            "For some drops and every probe, measured and simulated displacement against time, and the difference.",
            partial(measured_against_simulated, {EXTENDED: evidence.extended_left}, evidence.shown),
        ),
    ]
    return Section("Measured against the extended model", tuple(blocks))
