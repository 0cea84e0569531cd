"""What the diagnosis says, in a sentence, with its reasons."""

from __future__ import annotations

from tdbsim.effect import catalogue

from tdbmon.diagnosis.contender import EXPLAINED, Contender
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.verdict import Kind
from tdbmon.quantity import capitalised, percent
from tdbmon.report.document import Block, Paragraph, Section, Tone, Verdict
from tdbmon.report.remarks import grouped

_TONE: dict[Kind, Tone] = {
    Kind.NONE: "good",
    Kind.NAMED: "attention",
    Kind.AMBIGUOUS: "attention",
    Kind.UNKNOWN: "attention",
}


def section(evidence: Evidence) -> Section:
    """Return verdict, reasons and remarks."""
    diagnosis = evidence.diagnosis
    blocks: list[Block] = [
        Verdict(_sentence(diagnosis), _TONE[diagnosis.verdict.kind]),
        Paragraph(f"Why: {diagnosis.verdict.why}."),
    ]
    causes = [cause for each in diagnosis.verdict.accused for cause in each.causes]
    causes += [cause for each in diagnosis.verdict.alike for cause in each.causes]
    for cause in {cause.name: cause for cause in causes}.values():
        blocks.append(Paragraph(f"{capitalised(cause.words)}: {cause.declared.what}"))
    if diagnosis.verdict.kind is Kind.NONE:
        blocks.append(
            Paragraph(
                f"{len(catalogue())} kinds of effects were looked for, each at every place of the machine that it can act"
                " on. One of them would have been named if the plain model had left clearly more than noise, a model with"
                f" it no more than {EXPLAINED:g} times what noise leaves, and that model had done better on a drop held"
                " out. An effect too small for these drops to show is not excluded."
            )
        )
    if diagnosis.mistaken is not None:
        blocks.append(
            Paragraph(
                "No cause was sought: effects would fit what is not there. What follows shows the plain model, as the machine"
                " file has it, against the drops."
            )
        )
    elif diagnosis.changed is not None:
        blocks.append(
            Paragraph(
                "No effect of the catalogue stands for this change, and none is missing beside it. What follows shows the plain"
                " model with the value as it is now."
            )
        )
    elif diagnosis.verdict.kind is Kind.UNKNOWN and diagnosis.late is not None:
        blocks.append(
            Paragraph(
                "Something acts later than the readings can be followed. No effect of the catalogue is sought there: look at"
                " the rest of the record, below."
            )
        )
    elif diagnosis.verdict.kind is Kind.UNKNOWN:
        blocks.append(
            Paragraph(
                "Something acts that no effect of the catalogue explains, alone or together with others. The models named"
                " below are the best that were found and are not believed; what is missing is shown as a force, with its"
                " directions and frequencies."
            )
        )
    records = [drop.name for drop in diagnosis.plain.problem.drops]
    blocks += [Verdict(remark, "attention") for remark in grouped(diagnosis.remarks, records)]
    return Section("Verdict", tuple(blocks))


def _sentence(diagnosis: Diagnosis) -> str:
    verdict = diagnosis.verdict
    count = len(diagnosis.plain.problem.drops)
    drops = "one drop" if count == 1 else f"{count} drops"
    if verdict.kind is Kind.NAMED:
        open_ = "" if len(verdict.accused) == 1 else ", of which order or with which law these drops leave open"
        return (
            f"{'Named' if verdict.doubt is None else 'Named, with doubt'}: {verdict.accused[0].words}"
            f" (probability {_share(diagnosis, verdict.accused[0])}, {drops}){open_}."
            + ("" if verdict.doubt is None else f" {verdict.doubt}.")
        )
    if verdict.kind is Kind.AMBIGUOUS:
        several = {each.effects: each for each in reversed(verdict.accused)}.values()
        shares = [(each.words, _share(diagnosis, each)) for each in reversed(several)]
        shares += [(each.words, probability_words(each.probability)) for each in verdict.alike]
        either = "; or ".join(f"{words} ({share})" for words, share in shares)
        return f"Ambiguous: {either}. These {drops} cannot decide between them."
    if diagnosis.mistaken is not None:
        return f"Unknown: the set-up is not what the machine file says ({drops})."
    if diagnosis.changed is not None:
        return f"Unknown: {diagnosis.changed} changed beyond what the machine file allows ({drops})."
    if verdict.kind is Kind.UNKNOWN:
        return f"Unknown: the model lacks something that is in no catalogue ({drops})."
    return f"None: the plain model lacks nothing that these {drops} show."


def probability_words(probability: float) -> str:
    """Return a probability in words; none is certain and none impossible."""
    if probability > 0.99:
        return "> 99 %"
    return "< 1 %" if probability < 0.01 else percent(probability)


def _share(diagnosis: Diagnosis, contender: Contender) -> str:
    """Return the probability of an accused model's causes, whatever their words and orders."""
    pairs = zip(diagnosis.contenders, diagnosis.verdict.probabilities, strict=True)
    accused = diagnosis.verdict.accused
    return probability_words(sum(p for each, p in pairs if each in accused and each.effects == contender.effects))
