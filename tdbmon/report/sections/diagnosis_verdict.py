"""Report section: the verdict of the diagnosis in a sentence, with its reasons."""

from __future__ import annotations

from tdbsim.effect import catalogue

from tdbmon.diagnosis.contender import EXPLAINED, Contender
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.held_out import LEAST_DROPS
from tdbmon.diagnosis.verdict import Kind
from tdbmon.identify.free_effect import effect_in_words
from tdbmon.quantity import capitalised, percent
from tdbmon.remarks import grouped
from tdbmon.report.document import Block, Paragraph, Section, Tone, Verdict, sentence

_TONE: dict[Kind, Tone] = {
    Kind.NONE: "good",
    Kind.NAMED: "attention",
    Kind.AMBIGUOUS: "attention",
    Kind.UNKNOWN: "attention",
}


def section(evidence: Evidence) -> Section:
    """Return the section with verdict, reasons and remarks."""
    diagnosis = evidence.diagnosis
    blocks: list[Block] = [
        Verdict(_sentence(diagnosis), _TONE[diagnosis.verdict.kind]),
        sentence(f"why: {diagnosis.verdict.why}"),
    ]
    causes = [cause for each in diagnosis.verdict.accused for cause in each.causes]
    causes += [cause for each in diagnosis.verdict.alike for cause in each.causes]
    for cause in {cause.name: cause for cause in causes}.values():
        blocks.append(Paragraph(f"{capitalised(cause.words)}: {cause.declared.what}"))
    if standing := diagnosis.plain.problem.standing:
        already = "; ".join(map(effect_in_words, standing))
        blocks.append(
            Paragraph(
                f"Already in the plain model: {already}. This effect is not tried again in its place; causes that the verdict"
                " names or excludes come in addition to it."
            )
        )
    if diagnosis.verdict.kind is Kind.NONE:
        blocks.append(Paragraph(_looked_for(diagnosis)))
    if diagnosis.mistaken is not None:
        blocks.append(
            Paragraph(
                "No cause was sought: effects would fit errors of the set-up. What follows compares the plain model, as"
                " stated in the machine file, with the drops."
            )
        )
    elif diagnosis.changed is not None:
        blocks.append(
            Paragraph(
                "No effect of the catalogue represents this change, and no other cause is missing. What follows shows the plain"
                " model with the value as it is now."
            )
        )
    elif diagnosis.verdict.kind is Kind.UNKNOWN and diagnosis.late is not None:
        blocks.append(
            Paragraph(
                "Something acts later than the readings can be followed. Of the catalogue only effects that build up with"
                f" rubbing are sought there ({_building_up()}), and none of them explains the rest of the record: see below."
            )
        )
    elif diagnosis.verdict.kind is Kind.UNKNOWN:
        blocks.append(
            Paragraph(
                "Something acts that no effect of the catalogue explains, alone or together with others. The models named"
                " below are the best that were found, but are not accepted; what is missing is shown as a force, with its"
                " directions and frequencies."
            )
        )
    records = [drop.name for drop in diagnosis.plain.problem.drops]
    blocks += [Verdict(remark, "attention") for remark in grouped(diagnosis.remarks, records)]
    return Section("Verdict", tuple(blocks))


def _looked_for(diagnosis: Diagnosis) -> str:
    """Return the conditions under which an effect would have been named."""
    comma, better, proof = ",", ", and that model had done better on a held-out drop", ""
    if len(diagnosis.plain.problem.drops) < LEAST_DROPS:
        comma, better, proof = " and", "", " A single drop cannot be held out as a proof."
    return (
        f"{len(catalogue())} kinds of effects were looked for, each at every place of the machine that it can act"
        f" on. One of them would have been named if the misfit of the plain model had been clearly more than that of noise{comma}"
        f" that of a model with it at most {EXPLAINED:g} times that of noise{better}.{proof} An effect"
        f" too small to show in {_these(diagnosis)} is not excluded."
    )


def _building_up() -> str:
    return ", ".join(each.title for each in catalogue() if each.kind.builds_up)


def _these(diagnosis: Diagnosis) -> str:
    count = len(diagnosis.plain.problem.drops)
    return "this one drop" if count == 1 else f"these {count} drops"


def _sentence(diagnosis: Diagnosis) -> str:
    verdict = diagnosis.verdict
    count = len(diagnosis.plain.problem.drops)
    drops = "one drop" if count == 1 else f"{count} drops"
    if verdict.kind is Kind.NAMED:
        open_ = "" if len(verdict.accused) == 1 else "; these drops leave its order or law open"
        return (
            f"{'Named' if verdict.doubt is None else 'Named, with doubt'}: {verdict.accused[0].words}"
            f" (probability {_share(diagnosis, verdict.accused[0])}, {drops}){open_}."
            + ("" if verdict.doubt is None else f" {verdict.doubt}.")
        )
    if verdict.kind is Kind.AMBIGUOUS:
        several = {each.effects: each for each in reversed(verdict.accused)}.values()
        shares = [(each.words, _share(diagnosis, each)) for each in reversed(several)]
        shares += [(each.words, probability_words(each.probability)) for each in verdict.alike]
        if verdict.or_nothing:
            shares.append(("nothing at all", probability_words(_probability(diagnosis, diagnosis.plain))))
        either = "; or ".join(f"{words} ({share})" for words, share in shares)
        return f"Ambiguous: {either}. {capitalised(_these(diagnosis))} cannot decide between them."
    if diagnosis.mistaken is not None:
        return f"Unknown: the set-up is not what the machine file says ({drops})."
    if diagnosis.changed is not None:
        return f"Unknown: {diagnosis.changed} changed beyond its tolerance in the machine file ({drops})."
    if verdict.kind is Kind.UNKNOWN:
        return f"Unknown: the model lacks something that is in no catalogue ({drops})."
    shows = "shows" if count == 1 else "show"
    beside = ", apart from what it already includes" if diagnosis.plain.problem.standing else ""
    return f"None: the plain model lacks nothing that {_these(diagnosis)} {shows}{beside}."


def probability_words(probability: float) -> str:
    """Return a probability as text, limited to "> 99 %" and "< 1 %"."""
    if probability > 0.99:
        return "> 99 %"
    return "< 1 %" if probability < 0.01 else percent(probability)


def _probability(diagnosis: Diagnosis, contender: Contender) -> float:
    return diagnosis.verdict.probabilities[diagnosis.contenders.index(contender)]


def _share(diagnosis: Diagnosis, contender: Contender) -> str:
    """Return the probability of a named model's effects, summed over the named models with the same effects."""
    pairs = zip(diagnosis.contenders, diagnosis.verdict.probabilities, strict=True)
    accused = diagnosis.verdict.accused
    return probability_words(sum(p for each, p in pairs if each in accused and each.effects == contender.effects))
