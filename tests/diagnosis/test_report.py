"""The report of a diagnosis: its sections, figures and formats."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tdbsim import state_layout
from tdbsim.rotor import build_rotor

from tdbmon.diagnosis.contender import without_cause
from tdbmon.diagnosis.contract import diagnosis_json, diagnosis_lines
from tdbmon.diagnosis.diagnose import Diagnosis
from tdbmon.diagnosis.evidence import Evidence
from tdbmon.diagnosis.extended_machine import extended_head
from tdbmon.diagnosis.held_out import HeldOut, Judge, together
from tdbmon.diagnosis.late_record import acts_later
from tdbmon.diagnosis.left_over import left_over
from tdbmon.diagnosis.reference import Change, Reference
from tdbmon.diagnosis.reference_contract import reference_json, reference_lines
from tdbmon.diagnosis.residual_force import residual_force
from tdbmon.diagnosis.suspects import suspects
from tdbmon.diagnosis.verdict import Kind, Verdict
from tdbmon.estimate import Estimate
from tdbmon.identify.parameters import restated_machine
from tdbmon.report.diagnosis_report import build_diagnosis_report
from tdbmon.report.document import Document, Figure, Paragraph, Table
from tdbmon.report.document import Verdict as Tinted
from tdbmon.report.html import render_html
from tdbmon.report.pdf import render_pdf
from tdbmon.report.sections import (
    diagnosis_changes,
    diagnosis_fit,
    diagnosis_force,
    diagnosis_gain,
    diagnosis_late_record,
    diagnosis_remains,
    diagnosis_sizes,
    diagnosis_values,
    diagnosis_verdict,
)
from tests.diagnosis.reported import CAUSE, DECAY_S, HORIZONS, late_of, words_of
from tests.figure_checks import assert_readable, figures_of, texts
from tests.identify import drops


def test_the_evidence_comes_in_its_order(report: Document) -> None:
    assert [section.title for section in report.sections] == [
        "Verdict",
        "Measured against the plain model",
        "Where and when the residual exceeds the noise",
        "The force that is missing",
        "Ranking",
        "Measured against the extended model",
        "The rest of the record",
        "Gain on a held-out drop",
        "Sizes of the causes",
        "What remains unexplained",
        "What to do next",
    ]


def test_the_report_says_what_was_found_where_and_how_large(report: Document) -> None:
    words = words_of(report)
    assert "Named: residual magnetic force at the rotor (probability 97 %, 2 drops)" in words
    assert "3.00 ms (2.90 to 3.10)" in words
    assert "removes 97.1 %" in words
    assert "Probe 'DE_B' was noisy" in words
    assert "Another drop." in words
    assert "The records are synthetic." in words


def test_what_is_told_beside_the_verdict_is_no_alarm(named: Diagnosis, evidence: Evidence) -> None:
    aside = replace(evidence, diagnosis=replace(named, aside=("the contacts slow the shaft 1.7 times as much",)))
    verdict, remains = diagnosis_verdict.section(aside), diagnosis_remains.remains(aside)
    assert "slow the shaft" not in words_of(Document("", "", (verdict,)))
    said = next(block for block in remains.blocks if "slow the shaft" in getattr(block, "text", ""))
    assert isinstance(said, Paragraph)
    assert any("remark: the contacts slow the shaft" in line for line in diagnosis_lines(aside.diagnosis))


def test_a_frequency_is_told_as_closely_as_the_time_tells_it(evidence: Evidence) -> None:
    """From 40 ms a line near 19 Hz was reported."""
    words = words_of(Document("", "", (diagnosis_remains.remains(evidence),)))
    resolution = 2 / HORIZONS[-1]  # Hann window
    near = [float(each) for each in re.findall(r"strongest near (\d+) Hz", words)]
    assert all(each >= 0.9 * resolution for each in near)
    assert near or "too slow to be resolved in so short a time" in words


def test_little_gain_has_no_good_colour(named: Diagnosis, evidence: Evidence) -> None:
    sure, doubtful = (
        replace(named, verdict=replace(named.verdict, doubt=doubt)) for doubt in (None, "the gain is small")
    )
    tones = []
    for each in (sure, doubtful):
        shown = diagnosis_gain.section(replace(evidence, diagnosis=each))
        assert shown is not None
        tones += [block.tone for block in shown.blocks if isinstance(block, Tinted)]
    assert tones == ["good", "plain"]


def test_the_terminal_has_the_sizes_of_the_report(named: Diagnosis) -> None:
    assert any(line.endswith(": decay time 3.00 ms (2.90 to 3.10), law exponential") for line in diagnosis_lines(named))
    (cause,) = diagnosis_json(named)["causes"]
    assert cause["parameters"]["decay_time_ms"]["value"] == pytest.approx(3.0)
    moved = Change(
        "DE.gap", Estimate(2.8e-4, 2.7e-4, 2.9e-4, "um", "fit"), Estimate(3e-4, unit="um", why="at its edge")
    )
    lines = reference_lines(Reference(named, (moved,), ()))
    assert "  changed since: DE.gap 280 um (270 to 290) before, 300.0 um (at its edge) since" in lines


def test_fitted_values_stand_beside_those_of_the_machine_file(named: Diagnosis, evidence: Evidence) -> None:
    gap = named.machine.touchdown_bearings[0].radial_gap
    name = f"{named.machine.touchdown_bearings[0].name}.radial_gap"
    within, at_edge = (Estimate.from_sigma(value, 1e-6, "um", "fit") for value in (gap.nominal, gap.high))
    said = {}
    for key, value in (("within", within), ("at its edge", at_edge)):
        shown = diagnosis_values.section(replace(evidence, diagnosis=replace(named, values={name: value})))
        assert shown is not None
        said[key] = words_of(Document("", "", (shown,)))
        assert f"({gap.low * 1e6:.4g} to {gap.high * 1e6:.4g})" in said[key]
    assert "the true value may lie beyond" in said["at its edge"] and "beyond" not in said["within"]
    assert "for exact laws of the model" in said["within"]  # of ten in one case none held the truth
    outside = replace(named, verdict=Verdict(Kind.UNKNOWN, (), (0.0, 0.04), ""), values={name: within})
    assert diagnosis_values.section(replace(evidence, diagnosis=outside)) is None


def test_a_value_that_changed_stands_beside_what_the_machine_file_has(named: Diagnosis, evidence: Evidence) -> None:
    """Later drops are fitted with the changed value, which the table gave as the machine file's."""
    name = f"{named.machine.ends[0]}.radial_gap"
    stated, changed = (
        named.machine.touchdown_bearings[0].radial_gap,
        2.0 * named.machine.touchdown_bearings[0].radial_gap.nominal,
    )
    later = restated_machine(named.machine, {name: changed})
    since = replace(named, machine=later, values={name: Estimate.from_sigma(changed, 1e-6, "um", "fit")})
    shown = diagnosis_values.section(replace(evidence, diagnosis=since), Reference(named, (), ()))
    assert shown is not None
    said = words_of(Document("", "", (shown,)))
    assert f"({stated.low * 1e6:.4g} to {stated.high * 1e6:.4g})" in said
    assert "changed beyond its tolerance since the reference drops" in said and "may lie beyond" not in said


def test_the_report_names_a_value_that_changed_and_no_mistake(named: Diagnosis, evidence: Evidence) -> None:
    changed = replace(named, verdict=Verdict(Kind.UNKNOWN, (), (0.0, 0.04), "it changed"), changed="DE.gap")
    said = words_of(Document("", "", (diagnosis_verdict.section(replace(evidence, diagnosis=changed)),)))
    assert "Unknown: DE.gap changed beyond its tolerance in the machine file (2 drops)." in said
    assert "in no catalogue" not in said and "Something acts" not in said


def test_report_and_terminal_say_the_same_of_the_reference_drops(named: Diagnosis) -> None:
    since = Reference(named, (), ("a value differs too",), "DE.gap (later drops): at its edge")
    said = words_of(build_diagnosis_report(named, since=since))
    assert "\nA value differs too." in said  # as a sentence, like other remarks in the report
    assert "\nNot compared: DE.gap (later drops): at its edge.\nNo other value of the machine changed" in said
    assert "  not compared: DE.gap (later drops): at its edge" in reference_lines(since)
    shown = "residual magnetic force at the rotor"  # it was residual_magnetic_force@rotor
    assert f"They already show {shown}" in said and reference_lines(since)[0] == f"reference (2 drops): named - {shown}"
    assert reference_json(since)["not_compared"] == "DE.gap (later drops): at its edge"
    rule = "3 times the half widths of both intervals and by half of its tolerance (a ball clearance: by all of it)"
    assert rule in said and any(rule in line for line in reference_lines(since))


def test_a_report_says_what_of_the_reference_drops_the_later_model_has(named: Diagnosis) -> None:
    """The report said that lobes, whose angle differs from drop to drop, stand in it."""
    found = named.contenders[0]
    free = replace(found.problem.free[0], each_held=({"ball": 3.0}, {"ball": 5.0}))
    ball = replace(found, problem=replace(found.problem, free=(free,)))
    for model, has in ((found, "includes residual magnetic force at the rotor."), (ball, "does not include it")):
        before = replace(named, verdict=replace(named.verdict, accused=(model,)))
        said = words_of(Document("", "", (diagnosis_changes.section(Reference(before, (), ())),)))
        assert f"the model of the later drops {has}" in said


def test_the_force_of_a_cause_left_out_is_found_as_the_missing_one(named: Diagnosis) -> None:
    """The simulations with and without the cause differ by the momentum of the residual force: the weight, for its decay time."""
    found = named.contenders[0]
    shared, _ = found.problem.values(found.fit.point, 0)
    decay = shared[f"{CAUSE}.decay_time"]
    assert decay == pytest.approx(DECAY_S, rel=0.05)
    rotor = build_rotor(named.machine)
    pairs = zip(left_over(without_cause(found, 0), found.horizon), left_over(found, found.horizon), strict=True)
    given, taken = [], []
    for bare, whole in pairs:
        force = residual_force(bare)
        time, both = force.time[force.fall], force.force.sum(axis=0)[force.fall]
        assert len(time) > 10
        n = bare.motion.model.n
        apart = whole.motion.state - bare.motion.state
        # momentum of the first mode, the rotor's translation
        velocity = apart[:, state_layout.mode_rates_x(n)][:, 0] + 1j * apart[:, state_layout.mode_rates_y(n)][:, 0]
        momentum = np.sqrt(rotor.total_mass) * np.diff(np.interp(time[[0, -1]], bare.time, velocity))[0]
        gained = np.trapezoid(both, time)
        given.append(gained / rotor.total_mass)
        taken.append(momentum / rotor.total_mass)
        assert abs(momentum) > 20e-3 * rotor.total_mass
        lasting = decay * (np.exp(-time[0] / decay) - np.exp(-time[-1] / decay))
        # the force of the levitated whirl adds to the weight and fades with it
        assert momentum.imag == pytest.approx(rotor.total_mass * named.machine.gravity * lasting, rel=0.15)
    # with noise of 0.25 um the velocity right after the release is uncertain by some mm/s
    assert abs(np.mean(given) - np.mean(taken)) < 3e-3 / np.sqrt(len(given))
    assert abs(np.degrees(np.angle(np.mean(given))) - 90) < 5


def test_the_extended_model_lacks_no_force_where_the_plain_one_does(evidence: Evidence) -> None:
    for plain, extended in zip(evidence.plain_force, evidence.extended_force, strict=True):
        assert extended.stands_out.max() < 0.1 < plain.stands_out.min()
        assert np.abs(extended.force).max() < 0.2 * np.abs(plain.force).max()
    loud = [np.std(left.residual) for left in evidence.plain_left]
    quiet = [np.std(left.residual) for left in evidence.extended_left]
    assert np.mean(quiet) < 1.2 * drops.NOISE < np.mean(loud)


def test_without_spectra_nothing_is_said_of_their_peaks(evidence: Evidence) -> None:
    """Three probes give no spectra, but the report said that no peak in them exceeded the noise."""
    blind = tuple(replace(left, to_ends=np.zeros_like(left.to_ends)) for left in evidence.extended_left)
    assert not any(left.sees_ends for left in blind)
    words = words_of(Document("", "", (diagnosis_remains.remains(replace(evidence, extended_left=blind)),)))
    assert "No peak of the residual's spectra exceeds" not in words


def test_figures_that_show_some_of_the_drops_say_which(evidence: Evidence) -> None:
    assert evidence.selection == ""
    four = replace(
        evidence,
        **{
            name: getattr(evidence, name) * 2
            for name in ("plain_left", "extended_left", "plain_force", "extended_force")
        },
    )
    said = "Of the 4 drops, the slowest, one between and the fastest are shown here: drop_97.nc"
    for section in (diagnosis_fit.plain(four), diagnosis_fit.extended(four), diagnosis_force.section(four)):
        assert section is not None
        assert said in next(block.caption for block in section.blocks if isinstance(block, Figure))
    assert any(isinstance(b, Figure) and said in b.caption for b in diagnosis_remains.remains(four).blocks)


def test_both_formats_are_made_and_light(report: Document) -> None:
    assert len(render_html(report).encode()) < 1_500_000
    assert render_pdf(report).startswith(b"%PDF")


def test_every_figure_is_readable(report: Document) -> None:
    assert_readable(report)
    assert not any("$" in texts(figure.draw()) for figure in figures_of(report))


def test_what_the_rest_of_the_record_shows_is_told_as_that(named: Diagnosis) -> None:
    later = (late_of("drop_97.nc", 2.5), late_of("drop_148.nc", 2.5))
    found = replace(
        named,
        contenders=(named.plain,),
        verdict=Verdict(Kind.UNKNOWN, (), (0.06,), acts_later(later) or ""),
        proof=None,
        parameters={},
        late=later,
    )
    words = words_of(build_diagnosis_report(found))
    assert "the 1X whirl is 2.5 times as simulated in drop_97.nc" in words
    assert "Something acts later than the readings can be followed." in words
    assert "(ring drag, Stribeck friction, thermal growth), and none of them explains" in words
    assert "deviates by 2 standard deviations in half of the drops" in words


def test_a_cause_found_in_the_rest_of_the_record_is_shown_beside_the_model_without_it(named: Diagnosis) -> None:
    before = (late_of("drop_97.nc", 2.5), late_of("drop_148.nc", 2.5))
    proof = HeldOut(("drop_97.nc", "drop_148.nc"), 9e-6, 3e-6, 2.5e-6, 50.0, 4.0, judge=Judge.REST)
    document = build_diagnosis_report(replace(named, late_before=before, proof=proof))
    rest = next(section for section in document.sections if section.title == "The rest of the record")
    told = " ".join(block.text for block in rest.blocks if isinstance(block, Paragraph))
    without, left = (sum(each.departure for each in records) for records in (before, named.late or ()))
    assert f"the squared deviations of amplitude and position sum to {left:.1f}, without to {without:.1f}" in told
    captions = [block.caption for block in rest.blocks if isinstance(block, (Table, Figure))]
    assert [("without the cause found here" in each, "with it" in each) for each in captions] == [
        (True, False),
        (True, False),
        (False, True),
        (False, True),
    ]
    tables = [block for block in rest.blocks if isinstance(block, Table)]
    assert tables[0].rows[0].cells[1] != tables[1].rows[0].cells[1]
    gain = next(section for section in document.sections if section.title == "Gain on a held-out drop")
    assert "its 1X whirl" in " ".join(block.text for block in gain.blocks if isinstance(block, Paragraph))


def test_what_a_size_goes_with_is_told_in_words(evidence: Evidence, monkeypatch: pytest.MonkeyPatch) -> None:
    partners = {f"{CAUSE}.decay_time": [("NDE.support_stiffness", 0.66), (f"{CAUSE}.decay_time", -0.6)]}
    monkeypatch.setattr(diagnosis_sizes, "correlated", lambda model: partners)
    sizes = diagnosis_sizes.section(evidence)
    assert sizes is not None
    (table,) = (block for block in sizes.blocks if isinstance(block, Table))
    owner = table.rows[0].cells[0]
    assert owner.endswith(": decay time") and "_" not in owner
    assert table.rows[0].cells[2] == f"NDE: support stiffness (+0.66), {owner} (−0.60)"


def test_of_several_causes_each_keeps_the_capitals_of_its_name_and_end(evidence: Evidence) -> None:
    """ "Stribeck friction at NDE" was "Stribeck friction at nde" above its table, and "stribeck friction" in sentences."""
    best = evidence.diagnosis.best
    everyone = suspects(evidence.diagnosis.machine, best.problem.drops[0].probes, ())
    rubs = replace(best, causes=tuple(each for each in everyone if each.name == "stribeck_friction@NDE")[:1])
    verdict = replace(evidence.diagnosis.verdict, accused=(best, rubs))
    sizes = diagnosis_sizes.section(replace(evidence, diagnosis=replace(evidence.diagnosis, verdict=verdict)))
    assert sizes is not None
    captions = [block.caption for block in sizes.blocks if isinstance(block, Table)]
    assert captions == [
        "Residual magnetic force at the rotor (law exponential): values with 95 % intervals",
        "Stribeck friction at NDE (law exponential): values with 95 % intervals",
    ]


def test_the_rest_of_the_record_is_drawn_of_the_drop_that_departs_most(evidence: Evidence) -> None:
    """Of four drops the figure showed the slowest, the third and the fastest, whichever the table spoke of."""
    left = [
        replace(evidence.plain_left[0], omega=speed, name=name)
        for speed, name in ((60.0, "a.nc"), (80.0, "b.nc"), (120.0, "c.nc"), (150.0, "d.nc"))
    ]
    late = tuple(late_of(each.name, 2.5 if each.name == "b.nc" else 1.0) for each in left)
    several = replace(evidence, plain_left=tuple(left), diagnosis=replace(evidence.diagnosis, late=late))
    assert several.shown == (0, 2, 3)
    rest = diagnosis_late_record.section(several)
    assert rest is not None
    (figure,) = (block for block in rest.blocks if isinstance(block, Figure))
    assert figure.caption.endswith(
        "the slowest, the one that deviates most and the fastest are shown here: a.nc, b.nc, d.nc."
    )
    drawn = set(texts(figure.draw()).splitlines())
    assert {"a", "b", "d"} <= drawn and "c" not in drawn


def test_what_each_of_several_drops_held_out_shows_of_a_weak_cause_is_listed(named: Diagnosis) -> None:
    one = HeldOut(("drop_97.nc",), 2.61e-7, 2.55e-7, 2.4e-7, 3000.0, 2800.0)
    other = HeldOut(("drop_148.nc",), 2.6e-7, 2.5e-7, 2.4e-7, 3200.0, 2960.0)
    document = build_diagnosis_report(replace(named, proof=together([one, other])))
    (gain,) = (section for section in document.sections if section.title == "Gain on a held-out drop")
    assert any(isinstance(block, Tinted) and "by the share in the last column" in block.text for block in gain.blocks)
    # not without both: no drop would remain
    assert any(
        "without each of drop_97.nc and drop_148.nc in turn." in getattr(block, "text", "") for block in gain.blocks
    )
    (table,) = (block for block in gain.blocks if isinstance(block, Table))
    assert [row.cells for row in table.rows] == [
        ("drop_97.nc", "0.261", "0.255", "0.240", "6.7 %"),
        ("drop_148.nc", "0.260", "0.250", "0.240", "7.5 %"),
    ]


def test_the_extended_file_says_whose_angles_it_has(named: Diagnosis) -> None:
    found = named.contenders[0]
    assert "differ from drop to drop" not in extended_head(named)
    free = replace(found.problem.free[0], each_held=({"ball": 3.0}, {"ball": 5.0}))
    ball = replace(found, problem=replace(found.problem, free=(free,)))
    head = extended_head(replace(named, verdict=replace(named.verdict, accused=(ball,))))
    assert f"are those of {named.plain.problem.drops[0].name}: residual magnetic force at the rotor" in head
