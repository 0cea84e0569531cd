"""Sections of the fitted model, honest where parts are missing."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial

import pytest
from tdbsim.machine import load_machine
from tdbsim.rotor import build_rotor, static_loads

from tdbmon.accessor import AnalysisView
from tdbmon.analysis.summary import FORCES_TELL
from tdbmon.estimate import Estimate
from tdbmon.history.extract import features_of
from tdbmon.history.feature import KINDS
from tdbmon.identify import fitted as module
from tdbmon.identify.agreement import agreement
from tdbmon.identify.calibrate import fit_drops
from tdbmon.identify.contract import fitted_json, force_lines
from tdbmon.identify.drop import measured_drop
from tdbmon.identify.fitted import FittedDrop
from tdbmon.identify.forces import forces_of
from tdbmon.identify.model_share import FORCES_HOLD
from tdbmon.quantity import toleranced
from tdbmon.report import build_report
from tdbmon.report.document import Document, Figure, Paragraph, Table, Verdict
from tdbmon.report.sections import natural_frequencies
from tdbmon.report.sections.agreement import section as agreement_section
from tdbmon.report.sections.fitted_values import fitted_values
from tdbmon.report.sections.forces import section as forces_section
from tdbmon.report.sections.summary import section as summary_section
from tdbmon.shipped import shipped
from tests.figure_checks import rendered
from tests.identify import drops
from tests.identify.spectral_line import line


def test_lines_stand_beside_the_modes_they_may_be(report: Document) -> None:
    section = next(s for s in report.sections if s.title.startswith("Natural frequencies"))
    table = next(b for b in section.blocks if isinstance(b, Table))
    told = [row.cells[3] for row in table.rows]
    assert told[0].startswith("swing 1:") and told[2].startswith("bounce:")
    assert told[1] == "none" and not any("2 x swing" in cell or "mains" in cell for cell in told)


def test_a_line_a_few_percent_off_is_no_mode(fitted) -> None:
    mode = fitted.natural_frequencies.modes[2]
    hz = mode.frequency.value
    assert natural_frequencies.nearest(mode, [line("a", 1.05 * hz)]) is None
    assert natural_frequencies.nearest(mode, [line("a", 1.02 * hz), line("b", 0.99 * hz)]).name == "b"


def test_residuals_say_what_was_not_fitted(report: Document, fitted) -> None:
    section = next(s for s in report.sections if s.title == "Measured against simulated")
    table = next(b for b in section.blocks if isinstance(b, Table))
    assert fitted.calibration.horizon == 0.022
    assert [("not fitted" in row.cells[0]) for row in table.rows] == [False, True, True]
    assert any(isinstance(b, Paragraph) and "no independent proof" in b.text for b in section.blocks)


def test_a_drop_with_the_probes_of_one_end_is_compared_there(calibration) -> None:
    """Two probes at the one end, one at the other: no rigid line, so the first end at its probes' plane, the other not."""
    problem = calibration.problem
    whole = problem.drops[0]
    keep = [i for i, probe in enumerate(whole.probes) if probe.name != "DE_B"]
    bare = replace(
        whole,
        probes=tuple(whole.probes[i] for i in keep),
        reading=whole.reading[keep],
        noise=tuple(whole.noise[i] for i in keep),
    )
    found = agreement(replace(calibration, problem=replace(problem, drops=(bare, *problem.drops[1:]))), 0, 0.03)
    assert list(found.ends) == ["NDE"] and found.ends["NDE"].plane == "probe"
    assert set(found.residuals[0].rms) == {"NDE_A", "NDE_B", "DE_A"}
    assert found.residuals[0].ratio < 1.3
    assert found.ends["NDE"].contacts[0].measured is not None


def test_the_first_page_says_how_hard_the_bearings_were_hit(report: Document, fitted) -> None:
    summary = next(s for s in report.sections if s.title == "Summary")
    table = next(b for b in summary.blocks if isinstance(b, Table) and b.caption.startswith("How hard"))
    assert table.header == ("Quantity", *fitted.forces.ends)
    told = []
    for row in table.rows[:2]:
        value, prefix = re.search(r"^([\d.]+).*?\b([kMG]?)(?:N|Pa)\b", row.cells[1]).groups()
        told.append(float(value) * {"": 1, "k": 1e3, "M": 1e6, "G": 1e9}[prefix])
    end = fitted.forces.ends["NDE"]
    assert told == pytest.approx([end.peak.value, end.stress.greatest.value], rel=0.01)
    machine = drops.machine()
    load = static_loads(machine, build_rotor(machine))["NDE"]
    over, against = (row.cells[1] for row in table.rows[2:])
    assert float(over.split()[0]) == pytest.approx(end.peak.value / load, rel=0.02)
    assert f"{100 * end.stress.greatest.value / 4.2e9:.0f} %" in against and against.startswith("below")


@pytest.mark.parametrize(("material", "told"), [("steel", False), ("silicon nitride", True)])
def test_the_static_limit_of_steel_balls_is_told_as_such_where_balls_are_ceramic(
    analysed, fitted, material, told
) -> None:
    first, other = analysed.machine.touchdown_bearings
    balls = first.balls.model_copy(update={"material": material})
    bearings = (first.model_copy(update={"balls": balls}), other)
    machine = analysed.machine.model_copy(update={"touchdown_bearings": bearings})
    summary = summary_section(replace(analysed, machine=machine), fitted)
    table = next(b for b in summary.blocks if isinstance(b, Table) and b.caption.startswith("How hard"))
    assert "4200 MPa" in table.rows[3].cells[0] and ("ISO 20056-2" in table.rows[3].cells[0]) == told


@pytest.mark.parametrize(("misfit", "doubted"), [(1.3, False), (76.6, True)])
def test_the_first_page_doubts_forces_of_a_model_that_fails(analysed, fitted, misfit, doubted) -> None:
    """Their intervals hold only what a model leaves that is about right."""
    calibration = replace(fitted.calibration, misfit=misfit)
    summary = summary_section(analysed, replace(fitted, calibration=calibration))
    said = [block.text for block in summary.blocks if isinstance(block, Verdict) and block.tone == "attention"]
    assert any("does not follow the first contacts" in text for text in said) == doubted


def test_the_first_page_counts_the_contacts_that_its_tables_pair(analysed, fitted) -> None:
    """The record of 70 ms holds no clearance circle; the fit knows where the shaft touches all the same."""
    assert all(end.contacts is None for end in analysed.ends.values())
    story = next(b.text for b in summary_section(analysed, fitted).blocks if isinstance(b, Paragraph))
    pairs = {name: end.contacts for name, end in fitted.agreement.ends.items()}
    for name, found in pairs.items():
        seen = sum(pair.measured is not None for pair in found)
        assert seen > 2 and f"{seen} contacts at {name}" in story
    assert "told apart" not in story
    alone = next(b.text for b in summary_section(analysed).blocks if isinstance(b, Paragraph))
    assert "not counted from the displacement alone" in alone and "fitted gaps" not in alone


@pytest.mark.parametrize(("off", "told"), [(2e-6, False), (30e-6, True)])
def test_a_circle_and_a_fit_whose_gaps_exclude_each_other_are_told(analysed, fitted, off, told) -> None:
    """A circle 30 um wider, to 10 um, than a gap that is fitted to some um."""
    gap = fitted.calibration.values["DE.radial_gap"]
    circle = Estimate.from_sigma(gap.value + off, 5e-6, "um", "circle")
    ends = analysed.ends | {"DE": replace(analysed.ends["DE"], air_gap=circle)}
    found = fitted.beside(replace(analysed, ends=ends))
    remarks = [remark for remark in found.calibration.remarks if "exclude each other" in remark]
    assert bool(remarks) == told
    shown = [b.text for b in summary_section(analysed, found).blocks if isinstance(b, Verdict)]
    lines = force_lines(found.calibration, found.forces)
    for said in (shown, lines):
        assert any("DE: the clearance circle gives" in each for each in said) == told
        assert not any("NDE: the clearance circle gives" in each for each in said)


@pytest.fixture(scope="module")
def lost(same_model):
    """A fit that leaves a path far from the shaft's: one probe reads four times too much."""
    machine, (record, _) = same_model
    wrong = record.copy()
    wrong["NDE_B"] = 4 * record["NDE_B"]
    calibration = fit_drops(machine, [wrong], horizons=(0.012,))
    return FittedDrop(calibration, *forces_of(calibration, seconds=0.03, members=8))


def test_no_force_is_told_of_a_path_that_is_not_the_shafts(lost) -> None:
    """Such numbers look like any others: value, interval and verdict of the stress, all of another drop."""
    gap = lost.calibration.machine.bearing("NDE").radial_gap.nominal
    assert lost.calibration.drops[0].residual_to(0.012).whole > 0.1 * gap
    for end in fitted_json(lost)["calibration"]["drops"][0]["ends"].values():
        for quantity in (end["peak_force_n"], end["stress_mpa"]["max"], end["ring_at_speed_s"]):
            assert quantity["value"] is None and "of the gap" in quantity["why"]
        assert end["stress_mpa"]["mean"] is None and end["contact_forces"] == []
    lines = force_lines(lost.calibration, lost.forces)
    assert sum("forces and stresses: not estimated" in line for line in lines) == 1
    assert not any("peak force" in line or "MPa" in line for line in lines)


def test_a_withheld_force_is_in_no_report_and_no_archive(analysed, lost) -> None:
    document = build_report(analysed, fitted=lost)
    summary = next(s for s in document.sections if s.title == "Summary")
    assert any(isinstance(b, Verdict) and b.text.startswith("How hard") for b in summary.blocks)
    rows = [row.cells for s in document.sections for b in s.blocks if isinstance(b, Table) for row in b.rows]
    assert not any("Greatest" in cells[0] or "4200 MPa" in cells[0] for cells in rows)
    section = next(s for s in document.sections if s.title.startswith("Forces and stresses"))
    assert not any(isinstance(block, Figure) for block in section.blocks)
    filed = [f for f in features_of(analysed, lost) if KINDS[f.name].forces]
    assert len(filed) > 10
    assert all(f.estimate.value is None and "of the gap" in f.estimate.why for f in filed)


def test_one_lost_drop_does_not_withhold_the_forces_of_those_fitted_with_it(fitted, lost) -> None:
    calibration = fitted.calibration
    drops_ = (calibration.drops[0], lost.calibration.drops[0])
    mixed = replace(calibration, drops=drops_, trusted=0.012)
    first, other = forces_of(mixed, seconds=0.02, members=8)
    assert first.ends["NDE"].peak.known and not first.withheld and other.withheld
    section = forces_section(FittedDrop(mixed, first, others=(other,)))
    table = next(b for b in section.blocks if isinstance(b, Table) and b.caption.startswith("All drops"))
    assert "withheld" in table.rows[1].cells and "withheld" not in table.rows[0].cells
    boxes = rendered(next(b for b in section.blocks if isinstance(b, Figure) and b.name == "stress-outliers").draw())
    assert [label.get_text() for label in boxes.axes[0].get_xticklabels()] == ["drop_97"]


def test_what_the_intervals_of_forces_hold_stands_beside_them(report: Document, analysed, fitted) -> None:
    """On the first page they were "95 % intervals" without a word, and that they did not hold stood pages later."""
    summary = next(s for s in report.sections if s.title == "Summary")
    at = next(i for i, b in enumerate(summary.blocks) if isinstance(b, Table) and b.caption.startswith("How hard"))
    beneath, table = summary.blocks[at + 1], summary.blocks[at]
    assert isinstance(beneath, Paragraph) and beneath.text == f"{FORCES_HOLD}."
    assert isinstance(table, Table) and "intervals of the fit" in table.caption
    section = next(s for s in report.sections if s.title.startswith("Forces and stresses"))
    said = [block.text for block in section.blocks if isinstance(block, Paragraph) and FORCES_HOLD in block.text]
    assert len(said) == 1 and "ship with tdbmon" not in said[0]
    assert sum(FORCES_HOLD in line for line in force_lines(fitted.calibration, fitted.forces)) == 1
    assert FORCES_HOLD in AnalysisView(analysed, fitted)._repr_html_()


def test_a_value_without_interval_has_its_reason_in_terminal_and_report(fitted) -> None:
    """Of the ring, which some simulations see reach the journal's speed and others do not."""
    why = "in 3 of 8 simulations the ring does not reach the journal's speed"
    late = Estimate(0.19, unit="s", method="made up", why=why)
    ends = {name: replace(end, ring_at_speed=late) for name, end in fitted.forces.ends.items()}
    told = replace(fitted, forces=replace(fitted.forces, ends=ends))
    lines = [line for line in force_lines(told.calibration, told.forces) if "ring at speed" in line]
    assert len(lines) == 2 and all(line.endswith(f"0.1900 s ({why})") for line in lines)
    rows = [row for block in forces_section(told).blocks if isinstance(block, Table) for row in block.rows]
    (cells,) = [row.cells[1:] for row in rows if row.cells[0].startswith("Inner ring at shaft speed")]
    assert cells == (f"0.1900 s ({why})",) * 2


def test_values_that_went_as_far_as_they_may_are_told_in_terminal_and_report(fitted) -> None:
    """One by its tolerance, and one that no machine file states: an edge of a tolerance is that of the former alone."""
    bound = "NDE.friction", "DE.centre_x"
    told = replace(fitted, calibration=replace(fitted.calibration, at_bound=bound))
    (line,) = [line for line in force_lines(told.calibration, told.forces) if "at the limit of their range" in line]
    friction = told.calibration.values["NDE.friction"].value
    assert f"NDE.friction {friction:.3f}"[:-1] in line and "DE.centre_x" in line and " um" in line and "µ" not in line
    assert not any("at the limit of their range" in line for line in force_lines(fitted.calibration, fitted.forces))
    rows = [row for block in forces_section(told).blocks if isinstance(block, Table) for row in block.rows]
    said = {row.cells[0]: row.cells[-1] for row in rows}
    assert said["NDE: friction"].startswith("at the limit of its tolerance:")
    assert said["DE: bearing's centre x from the probes' zero"].startswith("at the limit of its range:")


def test_fitted_values_stand_beside_the_machine_files(fitted) -> None:
    """In words: ``generator.amount`` is a key of nobody's file."""
    full = load_machine(shipped("short/machine.toml"))
    plane, magnet = full.rotor.unbalance[0], full.magnetic_bearings[0]
    made = {
        f"{plane.name}.amount": Estimate(50e-6, 41e-6, 60e-6, "g mm"),
        f"magnet {magnet.name}.stiffness": Estimate(4e6, 3e6, 5e6, "N/m"),
        "NDE.ball_stiffness": Estimate(1.05e10, 1e10, 1.1e10, "N/m^1.5"),
    }
    told = replace(fitted.calibration, machine=full, values=fitted.calibration.values | made)
    rows = {row.cells[0]: row.cells[1:] for row in fitted_values(replace(fitted, calibration=told)).rows}
    assert not any("_" in name or "." in name for name in rows)
    gap = full.bearing("NDE").radial_gap
    assert rows["NDE: radial gap"][1] == toleranced(gap, "um") == "250 µm (200 to 300)"
    assert rows[f"{plane.name}: amount of the unbalance"][1].startswith(f"{plane.amount.nominal * 1e6:.0f} g mm (")
    assert "MN/m (" in rows[f"magnetic bearing {magnet.name}: stiffness"][1]
    assert rows["NDE: ball stiffness"][1].endswith(" N/m^1.5 (no tolerance)")
    assert rows["NDE: bearing's centre x from the probes' zero"][1] == "–"


@pytest.mark.parametrize("exponent", [10 / 9, 1.15])
def test_a_contact_of_another_exponent_has_the_unit_of_that_law(fitted, exponent) -> None:
    """A stiffness in N/m^(10/9) stood beside an exponent of 1.15: it is that of the same force at 10 um."""
    stiffness = 1.24e9
    bearings = tuple(
        each.model_copy(update={"contact_stiffness": stiffness, "contact_exponent": exponent})
        for each in fitted.calibration.calibrated.touchdown_bearings
    )
    calibrated = fitted.calibration.calibrated.model_copy(update={"touchdown_bearings": bearings})
    values = {"NDE.contact_stiffness": Estimate(stiffness, 1.1e9, 1.4e9, "N/m^(10/9)")}
    told = replace(fitted.calibration, calibrated=calibrated, values=values)
    (row,) = fitted_values(replace(fitted, calibration=told)).rows
    assert row.cells[0] == "NDE: contact stiffness from the force at 10 µm"
    law = re.search(r"([\d.]+) ×10⁹ N/m\^([\d.]+) times depth\^1\.150$", row.cells[-1])
    assert bool(law) == bool(row.cells[-1]) == (exponent == 1.15)
    if law is not None:
        force = float(law[1]) * 1e9 * 10e-6 ** float(law[2])
        assert force == pytest.approx(stiffness * 10e-6 ** (10 / 9), rel=1e-3)


def test_what_was_not_fitted_is_not_told_as_fitted(fitted, analysed) -> None:
    """Of a machine file that states supports and friction without tolerance."""
    stated = {f"{end}.{field}" for end in ("NDE", "DE") for field in ("support_stiffness", "friction")}
    values = {name: value for name, value in fitted.calibration.values.items() if name not in stated}
    bare = FittedDrop(replace(fitted.calibration, values=values), fitted.forces)
    texts = [block.text for block in agreement_section(bare).blocks if isinstance(block, Paragraph)]
    (text,) = [text for text in texts if text.startswith("Friction by sensitivity")]
    assert "each end separately" not in text and text.count("(the machine file states no tolerance)") == 2
    natural = natural_frequencies.section(analysed, bare)
    assert any(
        isinstance(b, Paragraph) and "MN/m (the machine file states no tolerance)" in b.text for b in natural.blocks
    )
    figure = next(b for b in natural.blocks if isinstance(b, Figure) and b.name == "critical-speed-map")
    labels = {text.get_text() for text in rendered(figure.draw()).legends[0].get_texts()}
    assert "stiffness of the machine file" in labels and not any("95 %" in label for label in labels)


def test_a_reader_of_a_report_without_a_circle_is_sent_to_the_forces(analysed, fitted) -> None:
    """Twelve quantities of each end were named in a paragraph each, and that --forces fits them stood on the terminal alone."""
    hint = f"{FORCES_TELL[0].upper()}{FORCES_TELL[1:]}."
    summary = summary_section(analysed)
    assert [b.text for b in summary.blocks if isinstance(b, Paragraph)].count(hint) == 1
    (table,) = [b for b in summary.blocks if isinstance(b, Table) and b.caption == "Not estimated"]
    reasons = [row.cells[1] for row in table.rows]
    assert len(set(reasons)) == len(reasons)
    for end in analysed.ends.values():
        (what,) = [row.cells[0] for row in table.rows if row.cells[1] == end.unsettled]
        assert f"{end.name}: all but radius at rest from the swing" in what
    assert hint not in [b.text for b in summary_section(analysed, fitted).blocks if isinstance(b, Paragraph)]


def test_a_notebook_is_not_sent_to_the_forces_that_it_shows(analysed, fitted) -> None:
    assert analysed.forces_tell_contacts
    assert FORCES_TELL in repr(AnalysisView(analysed))
    shown = repr(AnalysisView(analysed, fitted))
    assert FORCES_TELL not in shown and "peak force on the ring" in shown
    greatest = ">Greatest normal force on the ring, first 0.05 s</td>"
    assert AnalysisView(analysed, fitted)._repr_html_().count(greatest) == len(fitted.forces.ends)
    assert greatest not in AnalysisView(analysed)._repr_html_()


def test_faults_of_other_records_are_told(same_model, fitted, monkeypatch) -> None:
    """The analysis is of the first record alone: what is wrong with another one, nothing else tells."""
    machine, (first, second) = same_model
    turned = second.copy()
    turned["NDE_A"], turned["NDE_B"] = second["NDE_B"], second["NDE_A"]
    problem = fitted.calibration.problem
    drops = (problem.drops[0], measured_drop(turned, machine))
    calibration = replace(fitted.calibration, problem=replace(problem, drops=drops))
    monkeypatch.setattr(module, "fit_drops", lambda machine, records, **_: calibration)
    monkeypatch.setattr(module, "forces_of", lambda calibration: (fitted.forces, *fitted.others))
    found = module.fit_drop(machine, first, lambda _: None, [turned])
    assert any(each.startswith("drop_148.nc: NDE: ") for each in found.calibration.remarks)
    assert not any(each.startswith("drop_97.nc: NDE: ") for each in found.calibration.remarks)


def test_drops_fitted_together_stand_in_one_table(report: Document, fitted) -> None:
    section = next(s for s in report.sections if s.title.startswith("Forces and stresses"))
    table = next(b for b in section.blocks if isinstance(b, Table) and b.caption.startswith("All drops"))
    assert [row.cells[0] for row in table.rows] == ["drop_97.nc, 97 Hz", "drop_148.nc, 148 Hz"]
    boxes = rendered(next(b for b in section.blocks if isinstance(b, Figure) and b.name == "stress-outliers").draw())
    for ax in boxes.axes:
        assert [label.get_text() for label in ax.get_xticklabels()] == ["drop_97", "drop_148"]
    content = fitted_json(fitted)
    assert [set(drop["ends"]) for drop in content["calibration"]["drops"]] == [{"NDE", "DE"}] * 2
    assert content["coast_down"] is None


def test_the_first_record_is_the_drop_and_the_others_go_with_it(same_model, monkeypatch) -> None:
    machine, records = same_model
    monkeypatch.setattr(module, "fit_drops", partial(fit_drops, horizons=(0.006, 0.01)))
    monkeypatch.setattr(module, "forces_of", partial(forces_of, seconds=0.02, members=8))
    found = module.fit_drop(machine, records[1], lambda _: None, records[:1])
    assert [drop.name for drop in found.calibration.drops] == ["drop_148.nc", "drop_97.nc"]
    assert found.forces.name == "drop_148.nc" and [drop.name for drop in found.others] == ["drop_97.nc"]
    assert found.agreement.name == "drop_148.nc"
