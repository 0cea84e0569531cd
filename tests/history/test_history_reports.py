"""Reports and figures of a history: whole in both formats, nothing clipped, empty parts said."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from decimal import Decimal

import numpy as np
import pypdf
import pytest
from tdbsim.machine import load_machine

from tdbmon.estimate import Estimate
from tdbmon.figures.differences import differences
from tdbmon.figures.fleet import fleet as fleet_figure
from tdbmon.figures.machine_courses import machine_courses, shown_courses
from tdbmon.figures.stress_history import stress_history
from tdbmon.figures.trends import trends
from tdbmon.history.compare import compare, filed_drop
from tdbmon.history.contract import comparison_json
from tdbmon.history.fleet import fleet
from tdbmon.history.machine_history import machine_history
from tdbmon.history.not_compared import not_compared_count
from tdbmon.history.standing import Judged, judge
from tdbmon.history.summary import comparison_lines, seen_from, values_of
from tdbmon.history.unfiled import as_drop
from tdbmon.quantity import plain
from tdbmon.report.compare_report import build_compare_report
from tdbmon.report.document import Table
from tdbmon.report.fleet_report import build_fleet_report
from tdbmon.report.html import render_html
from tdbmon.report.machine_report import build_machine_report
from tdbmon.report.pdf import render_pdf
from tdbmon.report.sections import changes
from tdbmon.report.sections import trends as trends_section
from tests.figure_checks import assert_readable, faults, figures_of
from tests.history.conftest import YEARS
from tests.history.made import ENDS, HOSTILE, add, files, filing, fill, judged, latest, without


@pytest.fixture(scope="module")
def reports(years, comparison, history, stressed):
    """Reports of every kind, of drops with and without forces."""
    stressed_last = latest(stressed)
    return [
        build_compare_report(Judged(comparison)),
        build_compare_report(Judged(stressed_last)),
        build_machine_report(history),
        build_machine_report(machine_history(stressed, HOSTILE)),
        build_fleet_report(fleet(years)),
        build_fleet_report(fleet(stressed)),
    ]


def test_every_figure_is_readable(reports):
    for document in reports:
        assert_readable(document)
    names = {figure.name for document in reports for figure in figures_of(document)}
    assert names >= {"differences", "trends", "stress-history", "machine-courses", "fleet"}


def test_the_current_drop_is_marked_among_the_stress_boxes(stressed):
    found = latest(stressed)
    assert set(found.stress) == {"NDE", "DE"}
    assert [drop for drop, _ in found.stress["DE"]] == [e.id for e in (*found.matched, found.entry)]
    figure = stress_history(found)
    for ax in figure.axes:
        colours = [patch.get_facecolor() for patch in ax.patches]
        assert len(colours) == len(found.stress["DE"])
        assert colours.count(colours[-1]) == 1  # the last box alone has its colour


def test_a_stress_box_has_no_cap_below_and_its_outliers_on_top(stressed):
    """The least is not filed: a cap at the box's edge said that it is there; dots hid behind the cap of the greatest."""
    found = latest(stressed)
    for ax, boxes in zip(stress_history(found).axes, found.stress.values(), strict=True):
        flat = [line for line in ax.lines if len(line.get_xdata()) == 2 and np.ptp(line.get_ydata()) == 0]
        caps = [line for line in flat if np.ptp(line.get_xdata()) > 0]
        low = {box.q1 * 1e-6 for _, box in boxes}
        assert not [line for line in caps if line.get_ydata()[0] in low and line.get_visible()]
        rings = [line for line in ax.lines if line.get_marker() == "o"]
        assert len(rings) == len(boxes)
        assert min(line.get_zorder() for line in rings) > max(
            line.get_zorder() for line in ax.lines if line not in rings
        )


def test_axes_name_their_quantity_and_the_drops_alike_in_all_figures_of_a_page(stressed):
    """Trends numbered the drops that the stresses named, and had nothing but a unit beside them."""
    found = latest(stressed)
    names = ["drop_1", "drop_2", "drop_4", "drop_5", "drop_7", "drop_8", "drop_10", "drop_11"]
    radii = [change for change in found.changes if change.kind.name == "gap_um"]
    drawing = trends(found, radii)
    for ax in (*drawing.axes, *stress_history(found).axes):
        assert [label.get_text() for label in ax.get_xticklabels()] == names
        assert ax.get_xlabel() == "drop (2020-01-02 to 2020-01-12)"
    assert {ax.get_ylabel() for ax in drawing.axes} == {"Radius at rest [µm]"}
    courses = machine_courses(machine_history(stressed, HOSTILE))
    assert "Fall [ms]" in {ax.get_ylabel() for ax in courses.axes}
    assert "drop_11" in [label.get_text() for label in courses.axes[0].get_xticklabels()]


def test_a_comparison_without_forces_says_so_where_the_boxes_would_be(comparison):
    document = build_compare_report(Judged(comparison))
    html = render_html(document)
    assert "archive add --forces" in html
    assert "How hard the bearings were hit" not in html  # a table of nothing but the count of drops
    assert f"Full drops of this assembly, {comparison.entry.raw_name} included" in html.split("What was compared", 1)[1]
    assert "stress-history" not in html
    assert "Changed against the drops before" in html
    assert "synthetic" in html


def test_the_first_page_tells_force_and_stress_against_the_drops_before_and_the_limit(stressed):
    found = latest(stressed)
    first = render_html(build_compare_report(Judged(found))).split("What was compared")[0]
    value = next(c for c in found.changes if c.kind.name == "stress_max_mpa" and c.end == "DE").estimate.value
    assert "How hard the bearings were hit" in first
    assert f"{100 * value / 4.2e9:.0f} % of 4200 MPa" in first


@pytest.mark.parametrize(("stress", "said"), [(2.03e9, "by no more than chance"), (3.2e9, "beyond chance"), (2e9, "")])
def test_a_stress_out_of_the_range_before_is_said_to_be_chance_or_not(empty, tmp_path, stress, said):
    """Beside a range it was left to the reader why a drop outside it had not changed."""
    for k, before in enumerate((1.98e9, 2.0e9, 2.02e9, 1.99e9, 2.01e9)):
        add(empty, tmp_path, k, stress=before, dropped=f"2020-01-{k + 1:02d}")
    found = judge(empty, add(empty, tmp_path, 9, stress=stress, dropped="2020-02-01"))
    blocks = build_compare_report(found).sections[0].blocks
    (hit,) = [b for b in blocks if isinstance(b, Table) and b.caption.startswith("How hard")]
    told = [row.cells[2] for row in hit.rows if "stress" in row.cells[0]]
    assert len(told) == 2
    assert all((f"this drop lies outside, {said}" in cell) == bool(said) for cell in told)


@pytest.mark.parametrize("before", [0, 2, 4])
def test_with_few_drops_before_the_values_stand_side_by_side(empty, tmp_path, before):
    """At commissioning the page had no value of the drop at all."""
    made = fill(empty, tmp_path, before + 1)
    sections = {s.title: s for s in build_compare_report(judge(empty, made[-1].drop)).sections}
    said, table = sections["Values of this drop"].blocks
    assert f"needs {5 - before} more earlier drop" in said.text and "100 Hz, at most 5 % off" in said.text
    assert table.header[1:] == (made[-1].raw_name, *(each.raw_name for each in made[:-1]))
    (row,) = [row for row in table.rows if row.cells[0] == "Radius at rest, NDE"]
    values = [next(f.estimate.value for f in each.features if f.key == ("gap_um", "NDE")) for each in made]
    assert [float(cell.split()[0]) for cell in row.cells[1:]] == pytest.approx(
        [1e6 * value for value in (values[-1], *values[:-1])], abs=0.6
    )


def test_with_drops_enough_no_values_are_listed_beside_each_other(comparison):
    titles = [section.title for section in build_compare_report(Judged(comparison)).sections]
    assert "Values of this drop" not in titles


def test_an_alarm_says_how_far_its_gap_is_from_the_limit_and_what_to_do(comparison):
    """20 um of wear at NDE; the fall through it is flagged."""
    first = build_compare_report(Judged(comparison)).sections[0]
    tables = {block.caption: block for block in first.blocks if isinstance(block, Table)}
    (row,) = tables["How far the gap is from its limit"].rows
    assert row.cells[0] == "Fall, release to first touch, NDE"
    assert float(row.cells[2].split(" %")[0]) == pytest.approx(100 * 20 / 266, abs=0.6)
    assert row.cells[3:] == ("20 %, 53 µm", "34 µm")
    steps = {each.cells[0]: each.cells[1] for each in tables["What to do next"].rows}
    assert steps["Look for the cause"] == (
        "tdbmon diagnose machine.toml drop_08.nc drop_09.nc drop_10.nc --reference drop_05.nc drop_06.nc drop_07.nc"
    )
    assert "at NDE, then DE" in steps["Inspect"]
    assert "set agreed_drops" in steps["Before another drop"]


def test_a_drop_as_before_asks_for_nothing(empty, tmp_path):
    found, verdict = judged(empty, fill(empty, tmp_path, 7)[-1].drop)
    assert verdict.word == "as before"
    assert "What to do next" not in render_html(build_compare_report(Judged(found)))


def test_damage_is_told_of_each_end(stressed):
    """The end that suffered most was told in the text below the table only."""
    found = latest(stressed)
    html = render_html(build_compare_report(Judged(found)))
    assert all(f"Damage at {end}, in drops like the first" in html for end in ENDS)
    assert found.life.damage == max(found.life.damages.values(), key=lambda each: each.value)


def test_every_line_of_the_terminal_names_its_end(stressed):
    found = latest(stressed)
    lines = comparison_lines(Judged(found))
    for change in (c for c in found.changes if c.difference is not None):
        this, before = (plain(text) for text in values_of(change)[:2])
        (line,) = [line for line in lines if line[2:].startswith(f"{change.title}  ")]
        n, seen = f"{change.difference.before.n}", plain(seen_from(change, found))
        columns = "  +".join(map(re.escape, (this, before, n, seen)))
        assert re.search(rf"  {columns}   ", line), "columns run into each other"


@pytest.mark.parametrize("both", [False, True])
def test_what_the_drop_judged_does_not_tell_has_a_mark_in_the_figures(empty, tmp_path, both):
    """An end that was lost looked like one of which nothing more had been asked."""
    ends = ENDS if both else ENDS[:1]
    fill(empty, tmp_path, 6)
    raw, machine = files(tmp_path, 7)
    empty.add(without(filing(raw, machine, dropped="2020-02-01", seed=7), *ends), raw, machine)
    found = latest(empty)
    radii = [change for change in found.changes if change.kind.name == "gap_um"]
    drawing = trends(found, radii)
    for ax, change in zip(drawing.axes, radii, strict=False):
        hollow = [line.get_xdata()[0] for line in ax.lines if line.get_markerfacecolor() == "none"]
        assert hollow == ([7] if change.end in ends else [])
        assert ax.get_title("left").endswith("· no value") == (change.end in ends)
        usual = np.median([e.value for _, e in change.earlier]) * 1e6
        (limit,) = [text for text in ax.texts if text.get_text() == "limit: growth by 20 %"]
        assert limit.xy[1] == pytest.approx(1.2 * usual, rel=0.01)
        assert ax.get_ylim()[0] < limit.xy[1] < ax.get_ylim()[1]
    assert faults(drawing) == []
    drawing = fleet_figure(fleet(empty))
    hollow = [line for line in drawing.axes[0].lines if line.get_markerfacecolor() == "none"]
    assert [line.get_xdata()[0] for line in hollow] == [7] * len(ends)
    assert len({line.get_ydata()[0] for line in hollow}) == len(ends)
    assert faults(drawing) == []


def test_ends_stand_as_in_the_machine_file_and_units_as_an_analysis_writes_them(years, comparison, history):
    assert load_machine(YEARS / "machine.toml").ends == ("NDE", "DE")
    lines = comparison_lines(Judged(comparison))
    places = [next(i for i, line in enumerate(lines) if f"Radius at rest, {end}  " in line) for end in ("NDE", "DE")]
    places += [next(i for i, line in enumerate(lines) if f"not compared at {end}:" in line) for end in ("NDE", "DE")]
    assert places[0] + 1 == places[1] and places[2] + 1 == places[3]
    assert any(" um " in line for line in lines) and not any(letter in line for line in lines for letter in "µ−")
    assert any(re.search(r" -\d", line) for line in lines)
    titles = [course.title for course in history.courses]
    assert titles[:2] == ["Radius at rest, NDE", "Radius at rest, DE"]
    unfiled = as_drop(years.filing(comparison.entry.id))
    assert [c.title for c in compare(years, unfiled).changes] == [c.title for c in comparison.changes]


def test_the_first_page_says_what_could_not_be_compared(comparison):
    lost = [
        replace(c, difference=None, differs=False, why="no two usable probes see it") if c.end == "NDE" else c
        for c in comparison.changes
    ]
    blind = replace(comparison, changes=tuple(lost))
    first = render_html(build_compare_report(Judged(blind))).split("What was compared")[0]
    assert "Not compared at NDE: radius at rest" in first
    assert "(no two usable probes see it)" in first
    (table,) = [b for b in changes.section(blind).blocks if isinstance(b, Table) and b.caption == "Not compared"]
    of_nde = [row.cells for row in table.rows if row.cells[1] == "no two usable probes see it"]
    assert len(of_nde) == 1  # a reason once, with all that it keeps
    assert of_nde[0][0].count("; ") + 1 == sum(c.end == "NDE" for c in comparison.changes)


def test_what_no_drop_tells_is_missed_too(empty, tmp_path):
    """A machine whose records all end before the shaft rests was compared by its whirl alone, and nothing said so."""
    for seed in range(7):
        raw, machine = files(tmp_path, seed)
        made = filing(raw, machine, dropped=f"2020-01-{seed + 1:02d}", seed=seed)
        lost = [
            replace(f, estimate=Estimate.missing(f.estimate.unit, "the shaft does not rest"))
            if f.end == "DE" and f.name in ("gap_um", "fall_time_ms", "peak_force_n", "levitated_1x_um")
            else f
            for f in made.features
        ]
        empty.add(replace(made, features=tuple(lost)), raw, machine)
    comparison = latest(empty)
    said = "ot compared at DE: radius at rest, fall, release to first touch (the shaft does not rest)"
    assert [line for line in comparison_lines(Judged(comparison)) if said in line]
    assert not_compared_count(comparison) == "2 at DE"
    for document in (
        build_compare_report(Judged(comparison)),
        build_machine_report(machine_history(empty, empty.machines()[0])),
        build_fleet_report(fleet(empty)),
    ):
        assert said in render_html(document)
    (table,) = [b for b in changes.section(comparison).blocks if isinstance(b, Table) and b.caption == "Not compared"]
    assert "Radius at rest, DE; Fall, release to first touch, DE" in [row.cells[0] for row in table.rows]


def test_what_differs_beside_the_verdict_stands_in_every_report(empty, tmp_path):
    fill(empty, tmp_path, 6)
    raw, machine = files(tmp_path, 7)
    values = {("levitated_1x_um", "NDE"): 6.0}
    empty.add(filing(raw, machine, dropped="2020-02-01", seed=7, values=values), raw, machine)
    comparison = latest(empty)
    for document in (
        build_compare_report(Judged(comparison)),
        build_machine_report(machine_history(empty, empty.machines()[0])),
        build_fleet_report(fleet(empty)),
    ):
        assert render_html(document).count("eside the verdict: Once per revolution in levitation, NDE") == 1


def test_what_changed_is_drawn_on_top_with_its_point_and_interval(comparison):
    """The scale is that of the data: the only changes had been arrows at its edge."""
    (ax,) = differences(comparison).axes
    labels = [label.get_text() for label in ax.get_yticklabels()]
    flagged = comparison.flagged
    assert len(flagged) == 3
    assert [label.partition(" (n")[0] for label in labels[:3]] == [change.title for change in flagged]
    low, high = ax.get_xlim()
    for row, change in enumerate(flagged):
        found = change.difference
        drawn = [
            x for line in ax.lines if list(line.get_ydata()) == [row] * len(line.get_xdata()) for x in line.get_xdata()
        ]
        assert sorted(drawn) == pytest.approx([x / found.error for x in (found.low, found.value, found.high)])
        assert low < min(drawn) and max(drawn) < high


def test_an_end_that_was_not_seen_is_missed_wherever_a_drop_is_judged(empty, tmp_path):
    """On the terminal, in the machine's and in the fleet's report: and the drop is not "as before"."""
    fill(empty, tmp_path, 6)
    raw, machine = files(tmp_path, 7)
    made = filing(raw, machine, dropped="2020-02-01", seed=7)
    empty.add(without(made, "NDE"), raw, machine)
    comparison = latest(empty)
    said = "ot compared at NDE: radius at rest"
    (line,) = [text for text in comparison_lines(Judged(comparison)) if said in text]
    assert line.endswith("more (the arc is too short)")
    for document in (
        build_compare_report(Judged(comparison)),
        build_machine_report(machine_history(empty, empty.machines()[0])),
        build_fleet_report(fleet(empty)),
    ):
        html = render_html(document)
        assert said in html and "(the arc is too short)" in html
        assert "Not compared at DE" not in html
    assert f"{not_compared_count(comparison)}</td>" in render_html(build_fleet_report(fleet(empty)))
    before = compare(empty, filed_drop(empty, empty.entries()[-2].id))
    assert not_compared_count(before) == "–"
    assert not any("not compared" in text for text in comparison_lines(Judged(before)))
    assert (
        not_compared_count(compare(empty, filed_drop(empty, empty.entries()[0].id))) == "–"
    )  # nothing to compare with


def test_before_and_difference_subtract_as_they_are_written(comparison):
    told = [c for c in comparison.changes if c.difference is not None]
    assert len(told) > 30
    features = {(f["name"], f["end"]): f for f in comparison_json(Judged(comparison))["features"]}
    for change in told:
        texts = values_of(change)
        this, before, difference = (Decimal(text.split()[0].replace("−", "-")) for text in texts)
        assert this - before == difference, change.title
        assert len({text.split(" (")[0].partition(" ")[2].split(" ")[0] for text in texts}) == 1, "one unit"
        feature = features[change.kind.name, change.end]
        apart = feature["value"]["value"] - feature["before"]["centre"]
        assert apart == pytest.approx(feature["difference"]["value"], rel=1e-9, abs=1e-9), change.title


@pytest.mark.parametrize(("stress", "drawn"), [(2.0e9, False), (3.9e9, True)])
def test_the_limit_of_the_stress_is_drawn_where_it_is_near(empty, tmp_path, stress, drawn):
    for i in range(4):
        add(empty, tmp_path, i, dropped=f"2020-01-{i + 1:02d}", stress=stress)
    figure = stress_history(latest(empty))
    for ax in figure.axes:
        lines = [line for line in ax.lines if len(line.get_ydata()) == 2 and list(line.get_ydata()) == [4200.0, 4200.0]]
        assert bool(lines) == drawn
        assert any("limit 4200 MPa" in text.get_text() for text in ax.texts)
    assert faults(figure) == []


@pytest.mark.slow
def test_all_reports_are_whole_in_both_formats(reports):
    for document in reports:
        html = render_html(document)
        assert "</script><b>" not in html
        pages = pypdf.PdfReader(io.BytesIO(render_pdf(document))).pages
        text = "\n".join(page.extract_text() for page in pages)
        for section in document.sections:
            assert section.title in text


def test_a_change_of_level_is_drawn_where_it_is_among_many_drops(empty, tmp_path):
    """The trend goes over the latest sixty of the drops before; the figure shows all of them."""
    number = 70
    for i in range(number):
        level = 1.0 if i < 50 else 1.3
        add(empty, tmp_path, i, dropped=f"{1950 + i}-01-01", values={("rebound_um", "NDE"): level + 0.01 * (i % 3)})
    found = latest(empty)
    (change,) = (c for c in found.changes if c.key == ("rebound_um", "NDE"))
    ax = trends(found, [change]).axes[0]
    before, after = (line.get_xdata().tolist() for line in ax.lines if line.get_linestyle() == "--")
    assert len(change.series) == 61
    assert before == [10, 50.5]
    assert after == [50.5, number]


def test_the_table_of_trends_tells_the_change_points_that_are_drawn(empty, tmp_path):
    (empty.folder / "archive.toml").write_text("format = 1\n[compare]\nsignificance = 0.0005\n")
    for i in range(16):
        add(empty, tmp_path, i, dropped=f"{1950 + i}-01-01", values={("rebound_um", "NDE"): 1.0 if i < 8 else 1.3})
    found = latest(empty)
    section = trends_section.section(found)
    (table,) = (block for block in section.blocks if isinstance(block, Table))
    (row,) = (row for row in table.rows if row.cells[0] == "Rebound after the first contact, NDE")
    assert row.cells[-1].startswith("from drop_8.nc on")


def test_measured_drops_beside_synthetic_ones_are_not_called_synthetic(empty, tmp_path):
    for i in range(4):
        raw, machine = files(tmp_path, i)
        made = filing(raw, machine, name="ab"[i // 2], seed=i, dropped=f"2020-01-{i + 1:02d}")
        empty.add(replace(made, synthetic=i == 0), raw, machine)
    last = compare(empty, filed_drop(empty, empty.entries("a")[-1].id))
    note = "1 of the {} records is synthetic: it was computed, not measured."
    assert build_compare_report(Judged(last)).note == note.format(2)
    assert build_machine_report(machine_history(empty, "a")).note == note.format(2)
    assert build_machine_report(machine_history(empty, "b")).note == ""
    assert build_fleet_report(fleet(empty)).note == note.format(4)


LONG = "2024-05-11_Auslauf_Größe_7_Versuch_{:02d}_ohne_Öl.tdms"


@pytest.mark.parametrize("speeds", [(100.0,), (100.0, 100.0), tuple(10.0 * 1.2**k for k in range(14))])
def test_long_names_of_records_and_many_speeds_have_room(empty, tmp_path, speeds):
    """Names aslant stood on the titles below; of eight classes of speed one had the look of another."""
    for i, speed in enumerate(speeds):
        raw, machine = files(tmp_path, i)
        raw = raw.rename(raw.with_name(LONG.format(i)))
        made = filing(raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}", speed=speed, stress=2e9)
        empty.add(made, raw, machine)
    history = machine_history(empty, empty.machines()[0])
    drawing = machine_courses(history)
    assert faults(drawing) == []
    looks = [(line.get_color(), line.get_marker()) for line in drawing.legends[0].get_lines()]
    assert len(set(looks)) == len(looks) >= len({*speeds})
    assert faults(stress_history(history.judged[-1].comparison)) == []


def test_every_lowest_panel_names_its_drops(comparison, history):
    """With an odd number of panels the right column had no words below its lowest."""
    shown = [change for change in comparison.changes if change.trend is not None][:3]
    whole = shown_courses(history)
    few = replace(history, courses=tuple(whole[:7]))
    for drawing in (trends(comparison, shown), machine_courses(few)):
        panels = [ax for ax in drawing.axes if ax.get_visible()]
        assert len(panels) % 2
        assert all(ax.get_xlabel().startswith("drop (2015") for ax in panels[-2:])
        assert not any(ax.get_xlabel() for ax in panels[:-2])


def test_quantities_of_ends_with_long_names_have_room(comparison):
    """They left the page."""
    changes = [replace(change, end="Nichtantriebsseite" if change.end else "") for change in comparison.changes]
    assert faults(differences(replace(comparison, changes=tuple(changes)))) == []
