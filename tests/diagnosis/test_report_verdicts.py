"""The report's text for every verdict, and for a single drop."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from tdbsim.effect import catalogue
from tdbsim.stated_effects import parse

from tdbmon.diagnosis.contender import Contender
from tdbmon.diagnosis.contract import diagnosis_json, diagnosis_lines
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.late_record import acts_later
from tdbmon.diagnosis.suspects import suspects
from tdbmon.diagnosis.verdict import Kind, Verdict
from tdbmon.report.diagnosis_report import build_diagnosis_report
from tdbmon.report.document import Document, Table
from tdbmon.report.sections import (
    diagnosis_fit,
    diagnosis_late_record,
    diagnosis_ranking,
    diagnosis_verdict,
)
from tests.diagnosis.reported import late_of, words_of


def test_none_says_how_well_the_plain_model_fits(named: Diagnosis) -> None:
    plain = named.plain
    found = replace(
        named,
        contenders=(plain,),
        verdict=Verdict(Kind.NONE, (), (1.0,), "noise alone"),
        proof=None,
        parameters={},
    )
    document = build_diagnosis_report(found)
    words = words_of(document)
    titles = [section.title for section in document.sections]
    assert "None: the plain model lacks nothing that these 2 drops show." in words
    assert f"misfit is {plain.times_noise} times" in words
    assert f"{len(catalogue())} kinds of effects were looked for" in words
    assert not any("extended" in title or "Gain" in title or "Sizes" in title for title in titles)


def _of_one_drop(model: Contender) -> Contender:
    problem = model.problem
    return replace(model, problem=replace(problem, drops=problem.drops[:1], own=problem.own[:1]))


def test_what_stands_in_the_plain_model_is_told(named: Diagnosis, evidence: Evidence) -> None:
    """With an oval in the machine file the verdict said that the model lacks nothing, and did not mention the oval."""
    oval = parse("oval_clearance:end=DE,amplitude=19.8270169 um,angle=35 deg")
    foundation = parse("foundation_mode:end=NDE,mass=40 kg")
    plain = replace(named.plain, problem=replace(named.plain.problem, standing=(oval, foundation)))
    none = Verdict(Kind.NONE, (), (1.0,), "noise alone")
    found = replace(named, contenders=(plain,), verdict=none, proof=None, parameters={})
    known = "oval clearance at DE (amplitude 19.827 um, angle 35 deg, law radial)"
    (line,) = (line for line in diagnosis_lines(found) if "already in the plain model" in line)
    assert known in line and "foundation mode at NDE" in line
    said = words_of(Document("", "", (diagnosis_verdict.section(replace(evidence, diagnosis=found)),)))
    assert "these 2 drops show, apart from what it already includes." in said and known in said
    first, _ = diagnosis_json(found)["standing"]
    assert (first["effect"], first["where"], first["held"]) == ("oval_clearance", "DE", {"law": "radial"})
    assert first["parameters"]["amplitude_um"]["value"] == pytest.approx(19.8270169)
    json.dumps(diagnosis_json(found), allow_nan=False)
    assert diagnosis_json(named)["standing"] == []


def test_a_reason_that_is_a_question_ends_as_one(named: Diagnosis, evidence: Evidence) -> None:
    asked = replace(named, verdict=Verdict(Kind.UNKNOWN, (), (0.0, 0.0), "are their cables exchanged?"))
    said = words_of(Document("", "", (diagnosis_verdict.section(replace(evidence, diagnosis=asked)),)))
    assert "Why: are their cables exchanged?\n" in said


def test_what_several_drops_lack_alike_is_one_line_on_a_terminal(named: Diagnosis) -> None:
    """The remark on records of another machine appeared once per drop, in three lines each."""
    several = replace(named, remarks=("drop_97.nc: record: of another", "drop_148.nc: record: of another", "one more"))
    remarks = [line for line in diagnosis_lines(several) if line.startswith("remark: ")]
    assert remarks == ["remark: drop_97.nc: record: of another. The same for drop_148.nc record", "remark: one more"]
    assert len(diagnosis_json(several)["remarks"]) == 3


def test_one_drop_is_spoken_of_as_one(named: Diagnosis, evidence: Evidence) -> None:
    """The report said "these one drop", and required a proof on a held-out drop, which a single drop cannot give."""
    found, plain = (_of_one_drop(each) for each in named.contenders)
    alone = replace(named, contenders=(found, plain), parameters={}, proof=None)
    none = replace(alone, verdict=Verdict(Kind.NONE, (), (0.0, 0.96), ""))
    said = words_of(Document("", "", (diagnosis_verdict.section(replace(evidence, diagnosis=none)),)))
    assert "the plain model lacks nothing that this one drop shows." in said
    assert "A single drop cannot be held out as a proof." in said and "had done better" not in said
    open_ = replace(alone, verdict=Verdict(Kind.AMBIGUOUS, (found,), (0.6, 0.0), ""))
    said = words_of(Document("", "", (diagnosis_verdict.section(replace(evidence, diagnosis=open_)),)))
    assert "This one drop cannot decide between them." in said
    fitted = diagnosis_fit.extended(replace(evidence, plain_left=evidence.plain_left[:1]))
    assert fitted is not None
    assert "Fitted to the same drop to" in words_of(Document("", "", (fitted,)))


def test_one_drop_is_not_judged_by_the_rest_of_its_record(named: Diagnosis, evidence: Evidence) -> None:
    """The report said what "would tell that something acts", whatever the single drop showed."""
    late = (late_of("drop_97.nc", 2.5),)
    assert acts_later(late) is None
    rest = diagnosis_late_record.section(replace(evidence, diagnosis=replace(named, late=late)))
    assert rest is not None
    said = words_of(Document("", "", (rest,)))
    assert "A single drop is not judged by this." in said and "something acts" not in said


def test_a_plain_model_that_cannot_be_told_apart_is_named_with_the_others(named: Diagnosis, evidence: Evidence) -> None:
    """It read "Ambiguous: residual magnetic force (70 %). These 2 drops cannot decide between them." for one cause."""
    verdict = Verdict(Kind.AMBIGUOUS, (named.contenders[0],), (0.7, 0.2), "", or_nothing=True)
    open_ = replace(evidence, diagnosis=replace(named, verdict=verdict))
    said = words_of(Document("", "", (diagnosis_verdict.section(open_),)))
    assert "(70 %); or nothing at all (20 %). These 2 drops cannot decide" in said
    assert diagnosis_json(named)["baseline"]["probability"] == 0.0


def test_where_no_cause_was_sought_none_is_said_to_have_been_tried(named: Diagnosis, evidence: Evidence) -> None:
    wrong = replace(
        named,
        contenders=(named.plain,),
        verdict=Verdict(Kind.UNKNOWN, (), (0.04,), ""),
        mistaken="exchanged",
        parameters={},
    )
    said = words_of(Document("", "", (diagnosis_ranking.section(replace(evidence, diagnosis=wrong)),)))
    assert "No effect was tried." in said and "every other effect" not in said


def test_a_likeliest_model_that_is_not_believed_is_said_not_to_be(named: Diagnosis, evidence: Evidence) -> None:
    """The table gave a cause 94 % though the verdict was none."""
    refuted = replace(named, verdict=Verdict(Kind.NONE, (), (0.94, 0.02), "the gain is none"), parameters={})
    said = words_of(Document("", "", (diagnosis_ranking.section(replace(evidence, diagnosis=refuted)),)))
    assert "why the likeliest model here is not accepted" in said
    said = words_of(Document("", "", (diagnosis_ranking.section(evidence),)))
    assert "not accepted" not in said and "without a proof on another" not in said


def test_unknown_does_not_pass_the_best_model_off_as_believed(named: Diagnosis) -> None:
    found = replace(named, verdict=Verdict(Kind.UNKNOWN, (), (0.01, 0.0), "much is left"), parameters={})
    document = build_diagnosis_report(found)
    words = words_of(document)
    assert "Unknown:" in words and "not accepted" in words
    assert "Values of the best model, which is not accepted" in [section.title for section in document.sections]
    ranking = next(s for s in document.sections if s.title == "Ranking")
    table = next(block for block in ranking.blocks if isinstance(block, Table))
    assert table.rows[-1].cells[:2] == ("something outside the catalogue", "99 %")


def test_ambiguous_names_all_with_their_probabilities(named: Diagnosis) -> None:
    machine = named.machine
    bow = next(each for each in suspects(machine, machine.probes, ()) if each.name == "shaft_bow@rotor")
    other = replace(named.contenders[0], causes=(bow,))
    found = replace(
        named,
        contenders=(named.contenders[0], other, named.plain),
        verdict=Verdict(Kind.AMBIGUOUS, (named.contenders[0], other), (0.6, 0.35, 0.0), "they cannot be told apart"),
    )
    words = words_of(build_diagnosis_report(found))
    assert "Ambiguous: residual magnetic force at the rotor (60 %); or shaft bow at the rotor (35 %)" in words


def test_one_cause_with_two_laws_is_named_once_with_the_probability_of_both(named: Diagnosis) -> None:
    other = replace(named.contenders[0])
    found = replace(
        named,
        contenders=(named.contenders[0], other, named.plain),
        verdict=Verdict(Kind.NAMED, (named.contenders[0], other), (0.6, 0.34, 0.0), "either law explains the drops"),
    )
    words = words_of(build_diagnosis_report(found))
    assert (
        "Named: residual magnetic force at the rotor (probability 94 %, 2 drops); these drops leave its order or law open"
        in words
    )


def test_one_drop_proves_no_gain(named: Diagnosis) -> None:
    words = words_of(build_diagnosis_report(replace(named, proof=None)))
    assert "no gain is proved" in words
    # the 4 per cent for other causes hold for models that gained there
    assert "15 % are left here" in words
