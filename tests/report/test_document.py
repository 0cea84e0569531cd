"""The tree of a report, and what it says."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import PIL.Image
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing

from tdbmon.analysis.result import Analysis
from tdbmon.analysis.summary import summary_lines
from tdbmon.analysis.whirl import Advance
from tdbmon.estimate import Estimate
from tdbmon.quantity import words
from tdbmon.record.finding import Check
from tdbmon.report import Document, build_report
from tdbmon.report.document import Figure, Paragraph, Row, Section, SignalViewer, Table, Verdict
from tdbmon.report.html import render_html
from tdbmon.report.sections import contact
from tdbmon.report.sections.findings import end_findings
from tests.figure_checks import figures_of


def _words(document: Document) -> str:
    """Everything that a reader reads, figures apart."""
    found = [document.title, document.subtitle, document.note]
    for section in document.sections:
        found.append(section.title)
        for block in section.blocks:
            if isinstance(block, Paragraph | Verdict):
                found.append(block.text)
            elif isinstance(block, Table):
                found += [block.caption, *block.header, *(cell for row in block.rows for cell in row.cells)]
            elif isinstance(block, Figure):
                found += [block.caption, block.alt]
    return "\n".join(found)


def _summary(document: Document) -> Section:
    return document.sections[0]


def test_a_table_with_a_cell_too_few_is_refused() -> None:
    with pytest.raises(ValueError, match="2 cells under 3 headings"):
        Table("t", ("a", "b", "c"), (Row(("1", "2")),))


def test_a_figure_name_that_could_leave_its_folder_is_refused() -> None:
    with pytest.raises(ValueError, match="may hold"):
        Figure("../x", "caption", "alt", lambda: None)  # type: ignore[arg-type,return-value]


def test_a_figure_too_heavy_for_svg_is_a_sharp_png() -> None:
    def draw() -> Drawing:
        drawing = Drawing(figsize=(6.7, 3.0))
        FigureCanvasAgg(drawing)
        values = np.random.default_rng(0).standard_normal(60_000)
        drawing.subplots().plot(values[:-1], values[1:], ".")
        return drawing

    image = Figure("heavy", "caption", "alt", draw).image
    assert image.kind == "png"
    width, height = PIL.Image.open(io.BytesIO(image.data)).size
    assert width >= 200 * image.width_mm / 25.4
    assert width / height == pytest.approx(6.7 / 3.0, rel=0.01)


def test_the_report_has_its_evidence(coastdown_report: Document) -> None:
    document = coastdown_report
    assert {figure.name for figure in figures_of(document)} >= {
        "first-contacts", "whole-record", "orbits-1", "orbits-2", "centreline", "gap-map", "first-contact",
        "speed-decay", "waterfall", "cascade", "full-spectrum", "bode",
    }  # fmt: skip
    assert any(isinstance(block, SignalViewer) for section in document.sections for block in section.blocks)


def test_the_viewer_of_signals_says_whether_runout_is_taken_off(short: Analysis) -> None:
    def said(analysis: Analysis) -> list[str]:
        blocks = [block for section in build_report(analysis).sections for block in section.blocks]
        return [block.title for block in blocks if isinstance(block, SignalViewer)]

    taken = replace(short, checks=(*short.checks, Check("slow roll", "", True, "subtracted")))
    for analysis, runout in ((short, "runout not compensated"), (taken, "slow roll compensated")):
        assert said(analysis) == [f"Displacement (not filtered, {runout}) and speed of the whole record"]


def test_how_samples_are_drawn_is_said_by_the_figure_alone(coastdown_report: Document) -> None:
    histories = [figure for figure in figures_of(coastdown_report) if figure.name in ("first-contacts", "whole-record")]
    assert len(histories) == 2
    for figure in histories:
        header = figure.draw().texts[0].get_text()
        assert ("every sample drawn" in header) != ("least and greatest of each bin drawn" in header)
        assert "sample" not in figure.caption and "bin" not in figure.caption


def test_the_summary_carries_the_numbers_of_the_analysis(coastdown: Analysis) -> None:
    said = _words(replace(build_report(coastdown), sections=(_summary(build_report(coastdown)),)))
    assert coastdown.rundown is not None
    assert words(coastdown.rundown.initial) in said
    for end in coastdown.ends.values():
        assert words(end.air_gap) in said
        assert words(end.stiffness) in said
        assert end.contacts is not None and end.contacts.first is not None
        assert words(end.contacts.first.rebound) in said
    assert coastdown.machine.name in said


def test_the_parts_of_the_gap_add_up_on_paper(coastdown: Analysis) -> None:
    for end in coastdown.ends.values():
        assert end.gap is not None and end.gap.radius.value is not None and end.air_gap.value is not None
        total = end.travel.balls + end.travel.contact + end.travel.support
        assert end.gap.radius.value - total == pytest.approx(end.air_gap.value, abs=1e-9)


def test_a_failed_check_is_on_the_first_page_and_first_in_its_table(short: Analysis) -> None:
    broken = Check("dead", "DE_A", False, "does not move: 0.00 um pk-pk")
    document = build_report(replace(short, checks=(*short.checks, broken)))
    verdicts = [block for block in _summary(document).blocks if isinstance(block, Verdict)]
    assert verdicts[0].tone == "attention"
    assert f"1 of {len(short.checks) + 1} checks" in verdicts[0].text and broken.detail in verdicts[0].text
    table = next(block for block in document.sections[1].blocks if isinstance(block, Table))
    assert table.rows[0].cells == ("dead", "DE_A", broken.detail)


def _with_gap_tolerance(analysis: Analysis, end: str, low: float, high: float) -> Analysis:
    from tdbsim.machine import Tolerant

    drawn = Tolerant(nominal=(low + high) / 2, low=low, high=high)
    bearings = tuple(
        b.model_copy(update={"radial_gap": drawn}) if b.name == end else b for b in analysis.machine.touchdown_bearings
    )
    return replace(analysis, machine=analysis.machine.model_copy(update={"touchdown_bearings": bearings}))


@pytest.mark.parametrize(
    ("offsets", "verdict"),
    [
        ((-50e-6, 50e-6), "inside"),
        ((20e-6, 40e-6), "outside"),
        ((-40e-6, -20e-6), "outside"),
        ((0.0, 40e-6), "not decided"),
    ],
)
def test_the_gap_is_held_against_the_drawing(coastdown: Analysis, offsets: tuple[float, float], verdict: str) -> None:
    gap = coastdown.ends["DE"].air_gap.value
    assert gap is not None
    document = build_report(_with_gap_tolerance(coastdown, "DE", gap + offsets[0], gap + offsets[1]))
    tables = [block for block in _summary(document).blocks if isinstance(block, Table)]
    row = next(row for table in tables for row in table.rows if row.cells[0] == "Air gap, DE")
    assert row.cells[3].startswith(verdict)
    marked = [b.text for b in _summary(document).blocks if isinstance(b, Verdict) and b.text.startswith("Air gap, DE")]
    assert bool(marked) == (verdict != "inside")


def test_backward_whirl_is_on_the_first_page(short: Analysis) -> None:
    onset = Estimate(0.15, 0.14, 0.16, "s")
    frequency = Estimate(-120.0, -125.0, -115.0, "Hz")
    longest = Advance(0.15, 0.2, -6.0, frequency, 0.2)
    seen = replace(
        short.whirl["DE"], longest_backward=longest, longest_full=longest, backward_onset=onset, full_onset=onset,
        frequency=frequency,
    )  # fmt: skip
    document = build_report(replace(short, whirl={**short.whirl, "DE": seen}))
    verdicts = [b for b in _summary(document).blocks if isinstance(b, Verdict) and "whirl" in b.text]
    assert [v.tone for v in verdicts] == ["attention"]
    assert verdicts[0].text.startswith("DE: backward whirl") and words(onset) in verdicts[0].text
    assert "−120 Hz" in _words(document)


def test_no_whirl_is_said_too(short: Analysis) -> None:
    assert any("did not whirl" in b.text for b in _summary(build_report(short)).blocks if isinstance(b, Verdict))


def test_what_is_missing_is_said_with_its_reason(short: Analysis) -> None:
    bare = replace(
        short, rundown=None, swing=None, release=None, lines=(), tracks=None, angle=None, whirl={}, phases=()
    )
    unsettled = Estimate.missing("um", "the shaft does not settle long enough")
    ends = {k: replace(e, gap=None, contacts=None, air_gap=unsettled) for k, e in short.ends.items()}
    bare = replace(bare, ends=ends)
    found = {finding.name: finding.estimate.why for finding in end_findings(bare, ends["DE"])}
    for name in (
        "Radius at rest",
        "First touch, after the release [time in the record]",
        "First contact, duration",
        "Rebound",
    ):
        assert found[name] == unsettled.why
    said = _words(build_report(bare))
    for phrase in ("holds no speed", "does not settle long enough", "The release was not found"):
        assert phrase in said


def test_a_record_of_speed_alone_still_gives_a_report(coastdown: Analysis) -> None:
    bare = replace(
        coastdown, planes=None, release=None, phases=(), ends={}, swing=None, angle=None, waterfall=None, lines=(),
        whirl={}, tracks=None,
    )  # fmt: skip
    document = build_report(bare)
    figures = figures_of(document)
    assert "speed-decay" in {figure.name for figure in figures}
    # whatever stands there can do without the displacement
    assert all(figure.draw().axes for figure in figures)
    assert not {figure.name for figure in figures} & {"whole-record", "orbits-1", "gap-map", "waterfall", "bode"}
    assert coastdown.rundown is not None and words(coastdown.rundown.initial) in _words(document)


def test_synthetic_records_are_called_so(short: Analysis) -> None:
    assert build_report(short, note="This record is synthetic.").note == "This record is synthetic."
    record = short.record.copy()
    record.attrs = {**record.attrs, "synthetic": 1}
    assert "synthetic" in build_report(replace(short, record=record)).note
    assert "synthetic" in build_report(short).note  # it ships
    record.attrs = {**record.attrs, "synthetic": 0, "sha256": "0" * 64}
    assert build_report(replace(short, record=record)).note == ""


def test_what_is_missing_of_an_end_is_said_once_on_the_first_page(short: Analysis) -> None:
    unsettled = Estimate.missing("um", "the shaft does not settle long enough")
    lost = replace(short.ends["NDE"], gap=None, contacts=None, air_gap=unsettled, stiffness=unsettled)
    page = replace(short, ends={**short.ends, "NDE": lost})
    summary = build_report(page).sections[0]
    said = [block.text for block in summary.blocks if isinstance(block, Paragraph)]
    said += [cell for block in summary.blocks if isinstance(block, Table) for row in block.rows for cell in row.cells]
    assert sum(unsettled.why in text for text in said) == 1
    missing = next(b for b in summary.blocks if isinstance(b, Table) and b.caption == "Not estimated")
    (told,) = [row.cells[0] for row in missing.rows if row.cells[1] == unsettled.why]
    assert told.startswith("NDE: all but ") and "rebound" not in told
    table = next(b for b in summary.blocks if isinstance(b, Table) and b.caption.startswith("The touchdown bearings"))
    column = table.header.index("NDE")
    assert [row.cells[column] for row in table.rows if row.cells[0] == "Rebound"] == ["–"]
    assert all("not estimated" not in cell for row in table.rows for cell in row.cells)


def test_fitted_forces_need_no_hint_to_them(short: Analysis) -> None:
    unsettled = Estimate.missing("um", "the shaft still lifts off")
    lost = replace(short.ends["NDE"], gap=None, contacts=None, air_gap=unsettled, stiffness=unsettled)
    one = replace(short, ends={**short.ends, "NDE": lost})
    assert "--forces" in str(contact.section(one)) and "--forces" not in str(contact.section(one, fitted=True))


def test_contacts_after_a_late_beginning_are_listed_but_none_is_the_first(short: Analysis) -> None:
    why = "the record begins during a contact at NDE, after the release"
    late = {}
    for name, end in short.ends.items():
        assert end.contacts is not None
        events = (replace(end.contacts.events[0], seen=False), *end.contacts.events[1:])
        late[name] = replace(end, contacts=replace(end.contacts, first=None, events=events, why=why))
    document = build_report(replace(short, ends=late))
    (section,) = [s for s in document.sections if s.title == "Contacts"]
    said = _words(replace(document, sections=(section,)))
    assert f"The first contact at NDE is not estimated: {why}." in said
    assert "NDE: contacts before settling" in said and "incomplete" in said
    assert "contacts that were seen at NDE" in _words(document)


def test_provenance_is_complete(short: Analysis) -> None:
    said = _words(build_report(short))
    assert short.record.attrs["sha256"] in said
    assert "drop_100.nc" in said and "tdbmon 0." in said


def test_the_levitated_shaft_stands_beside_the_zones_of_the_standard(coastdown: Analysis) -> None:
    document = build_report(coastdown)
    (section,) = (each for each in document.sections if each.title == "Release and phases")
    (table,) = (b for b in section.blocks if isinstance(b, Table) and b.caption.startswith("Levitation"))
    for row, end in zip(table.rows, coastdown.ends, strict=True):
        reach = coastdown.levitation[end].reach
        assert row.cells[0] == end
        assert words(reach) in row.cells
        assert reach.value is not None
        # the synthetic machine levitates within a tenth of its gap of 250 um about the middle
        assert reach.value < 0.3 * 250e-6
        assert row.cells[-1] == "A"
    # beside the measured gap, another one
    assert sum("of the machine file's gap: zone A" in line for line in summary_lines(coastdown)) == 2


def test_units_are_printed_the_same_in_figures_checks_and_reasons(short: Analysis) -> None:
    """Checks and reasons are written for the terminal too; a name that looks like a unit is left."""
    checks = (
        Check("set point", "um", True, "the shaft levitated 12.5 (12 to 13) um from the centre"),
        Check("keyphasor", "us", True, "edges to 29 us"),
        Check("free fall", "", True, "falls with 9.8 m/s2, \u00b13 um"),
        Check("inertia", "", True, "polar inertia 0.2815 kg m^2 by the file"),
    )
    html = render_html(build_report(replace(short, checks=checks)))
    table = html[html.index("Checks that passed") :]
    for printed in ("12.5 (12 to 13) µm from", "29 µs", "9.8 m/s², ±3 µm", "0.2815 kg m² by", ">um<", ">us<"):
        assert printed in table


def test_a_reason_is_told_once_a_table(short: Analysis) -> None:
    why = "the arc is too short to tell a circle from"
    lost = Estimate.missing("um", why)
    bare = {
        name: replace(end, gap=None, contacts=None, air_gap=lost, stiffness=lost, gap_from_swing=lost, deepest=lost)
        for name, end in short.ends.items()
    }
    tables = {
        block.caption: block
        for section in build_report(replace(short, ends=bare)).sections
        for block in section.blocks
        if isinstance(block, Table)
    }
    for caption, rotor in (("Parts of the radius at rest (95 % intervals)", 0), ("Not estimated", 1)):
        said = [cell for row in tables[caption].rows for cell in row.cells if why in cell]
        assert len(said) == len(bare) + rotor, caption  # once an end, and once for the swing of the rotor
    assert any("Rebound" in row.cells[0] for row in tables["Not estimated"].rows)


def test_an_extrapolated_standstill_says_what_it_rests_on(short: Analysis) -> None:
    assert short.rundown is not None
    why = "no interval: it is not known whether the law holds down to standstill"
    rundown = replace(short.rundown, standstill_time=Estimate(60.4, unit="s", method="extrapolated", why=why))
    far = replace(short, rundown=rundown)
    assert any(line.startswith("standstill") and why in line for line in summary_lines(far))
    table = next(
        block
        for block in build_report(far).sections[0].blocks
        if isinstance(block, Table) and block.caption.startswith("The rotor")
    )
    assert any(row.cells[0].startswith("Standstill") and why in row.cells[1] for row in table.rows)
