"""Report section: the candidate models, ranked by probability."""

from __future__ import annotations

from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.probability import NAMED_OF_ONE, RIGHT_OF_ONE, WRONG, WRONG_OF_ONE
from tdbmon.diagnosis.verdict import Kind
from tdbmon.report.document import Block, Paragraph, Row, Section, Table
from tdbmon.report.sections.diagnosis_verdict import probability_words


def section(evidence: Evidence) -> Section:
    """Return the section with the ranking."""
    diagnosis = evidence.diagnosis
    ranked = sorted(
        zip(diagnosis.contenders, diagnosis.verdict.probabilities, strict=True),
        key=lambda pair: (-pair[1], pair[0].bic),
    )
    best = min(each.bic for each in diagnosis.contenders if each.horizon == diagnosis.best.horizon)
    accused = diagnosis.verdict.accused
    rows = []
    for contender, probability in ranked:
        words = "; ".join(cause.tried_with for cause in contender.causes if cause.held)
        comparable = contender.horizon == diagnosis.best.horizon
        rows.append(
            Row(
                (
                    contender.words + (f" ({words})" if words else ""),
                    probability_words(probability),
                    f"{contender.bic - best:.0f}" if comparable else "–",
                    contender.times_noise,
                    f"{contender.freedom:.0f}",
                    f"{contender.horizon * 1e3:.0f} ms",
                ),
                "attention" if contender in accused else "plain",
            )
        )
    for alike in diagnosis.verdict.alike:
        rows.append(Row((alike.words, probability_words(alike.probability), "–", "–", "–", "not fitted"), "attention"))
    rest = 1 - sum(diagnosis.verdict.probabilities) - sum(each.probability for each in diagnosis.verdict.alike)
    unknown = diagnosis.verdict.kind is Kind.UNKNOWN
    if rest > 1e-3 or unknown:
        other = "something outside the catalogue" if unknown else "something that is not listed"
        rows.append(Row((other, probability_words(max(rest, 0.0)), "", "", "", "")))
    why = diagnosis.verdict.doubt
    doubt = "" if why is None else f" Here {why}: so many models with so little gain were wrong in these tests."
    alone = ""
    if diagnosis.verdict.accused and diagnosis.proof is None:
        alone = (
            f" Of causes named from a single drop, without a proof on another, {RIGHT_OF_ONE} of {NAMED_OF_ONE} were right:"
            f" {100 * WRONG_OF_ONE:.0f} % are left here."
        )
    refuted = ""
    if diagnosis.verdict.kind is Kind.NONE and diagnosis.best.causes:
        refuted = " They are based on the fit alone: the verdict says why the likeliest model here is not accepted."
    header = ("Model", "Probability", "ΔBIC", "Misfit, times noise", "Additional values", "Fitted to")
    listed = (
        "Only models that reached the last horizon are listed; every other effect of the catalogue was tried at every place"
        " and promised less, or fell behind."
        if diagnosis.mistaken is None
        else "No effect was tried."
    )
    blocks: list[Block] = [
        Paragraph(
            f"{listed} ΔBIC is the difference of the Bayesian information criterion (misfit, plus the logarithm of"
            " the number of readings for each additional value) from the best. The probabilities weight it less than at"
            " face value, since no model is exact, and assume that all kinds of causes are equally likely beforehand."
            f" At least {100 * WRONG:.0f} % are left to causes that are not listed: this is how often, on synthetic drops made by"
            " another program, a model that explained them was the wrong one." + alone + doubt + refuted
        ),
        Table("Models by probability", header, tuple(rows)),
    ]
    return Section("Ranking", tuple(blocks))
