"""The report of a machine: its courses with rings, steps and trends."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tdbmon.estimate import Estimate
from tdbmon.figures.machine_courses import machine_courses
from tdbmon.history.feature import KINDS
from tdbmon.history.machine_history import machine_history
from tdbmon.report.document import Table
from tdbmon.report.html import render_html
from tdbmon.report.machine_report import build_machine_report
from tests.figure_checks import figures_of
from tests.history.made import add, files, filing, fill


def test_a_machine_report_draws_what_it_flags(history):
    assert history.flagged
    figure = machine_courses(history)
    titles = [ax.get_title(loc="left") for ax in figure.axes if ax.get_visible()]
    for (name, end), drops in history.flagged.items():
        assert f"{KINDS[name].title}{', ' + end if end else ''}" in titles
        assert set(drops) <= {e.id for e in history.entries}
    rings = [line for ax in figure.axes for line in ax.lines if line.get_label() == "changed against the earlier drops"]
    assert sum(len(line.get_xdata()) for line in rings) == sum(map(len, history.flagged.values()))


def test_what_is_flagged_of_a_record_that_is_left_out_alone_is_not_drawn_before_the_rest(empty, tmp_path):
    """Its panel stood first, without a mark or ring of the drops that it was there for."""
    fill(empty, tmp_path, 8)
    for i in (50, 51):
        add(
            empty, tmp_path, i, dropped=f"2021-01-{i - 40}", values={("gap_centre_x_um", "DE"): 1.3},
            failed_checks=("probe scales NDE",),
        )  # fmt: skip
    history = machine_history(empty, empty.machines()[0])
    assert any(c.kind.name == "gap_centre_x_um" for c in history.last.comparison.flagged)
    assert history.flagged == {}
    assert not any("Clearance" in ax.get_title(loc="left") for ax in machine_courses(history).axes)


def test_the_courses_tell_speeds_and_assemblies_apart_and_leave_out_what_shows_no_drop_of_the_machine(empty, tmp_path):
    """A speed has one name in all panels, though quantities are missing here and there."""
    for i in range(12):
        raw, machine = files(tmp_path, i)
        made = filing(
            raw, machine, seed=i, dropped=f"2020-01-{i + 1:02d}", speed=(60.0, 100.0)[i % 2] + 0.1 * i, few=i > 8,
            assembly="new" if i >= 6 else "", failed_checks=("machine",) if i == 3 else (),
        )  # fmt: skip
        empty.add(made, raw, machine)
    history = machine_history(empty, empty.machines()[0])
    figure = machine_courses(history)
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {"60.5 Hz", "100.6 Hz"}
    for ax in (ax for ax in figure.axes if ax.get_visible()):
        assert [line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == ":"] == [6.5]
    assert "drop_3.nc" not in {entry.raw_name for course in history.courses for entry, _ in course.values}
    assert "Left out, since checks of their records failed: drop_3.nc." in render_html(build_machine_report(history))


def test_a_machine_of_one_speed_has_trends_too(history):
    blocks = [block for section in build_machine_report(history).sections for block in section.blocks]
    assert "Trends over all drops" in [block.caption for block in blocks if isinstance(block, Table)]


@pytest.mark.parametrize(("last", "said"), [(1.12, True), (1.02, False)])
def test_a_drop_at_the_level_of_ringed_ones_without_a_ring_is_explained(empty, tmp_path, last, said):
    """Its estimate is so uncertain that the same difference is not beyond chance."""
    fill(empty, tmp_path, 7)
    add(empty, tmp_path, 50, dropped="2020-02-01", values={("fall_time_ms", "NDE"): 1.12})
    raw, machine = files(tmp_path, 51)
    made = filing(raw, machine, dropped="2020-02-02", seed=51, values={("fall_time_ms", "NDE"): last})
    wide = [
        replace(f, estimate=Estimate.from_sigma(f.estimate.value, 1e-3, "ms", "made up"))
        if f.key == ("fall_time_ms", "NDE")
        else f
        for f in made.features
    ]
    empty.add(replace(made, features=tuple(wide)), raw, machine)
    history = machine_history(empty, "made up")
    assert len(history.flagged["fall_time_ms", "NDE"]) == 1
    html = render_html(build_machine_report(history))
    assert ("but without a ring: Fall, release to first touch, NDE: drop_51.nc" in html) == said


def test_wear_at_once_is_told_as_a_step_and_not_as_a_rate(history):
    """The journal was worn between two drops: a radius that grows a little with each of ten was made of it."""
    blocks = [block for section in build_machine_report(history).sections for block in section.blocks]
    (table,) = [b for b in blocks if isinstance(b, Table) and b.caption == "Trends over all drops"]
    (row,) = [row for row in table.rows if row.cells[0] == "Fall, release to first touch, NDE"]
    assert row.cells[2] == "–" and "from drop_08.nc on" in row.cells[3]
    (ax,) = [ax for ax in machine_courses(history).axes if ax.get_title(loc="left") == row.cells[0]]
    assert [line.get_xdata()[0] for line in ax.lines if line.get_label() == "step"] == [7.5]


def test_a_machine_report_speaks_of_no_drop_that_it_does_not_name(stressed):
    html = render_html(build_machine_report(machine_history(stressed, stressed.machines()[0])))
    last = stressed.entries()[-1].raw_name
    assert f"In orange: {last}." in html and f"Full drops of this assembly, {last} included" in html
    assert "This drop in orange" not in html and "this one" not in html


def test_a_machine_report_does_not_say_any_drop_where_older_ones_are_not_judged(empty, tmp_path):
    for i in range(42):
        add(empty, tmp_path, i, dropped=f"{1950 + i}-01-01")
    figure, *_ = figures_of(build_machine_report(machine_history(empty, "made up")))
    assert figure.caption.startswith("The quantities flagged in any judged drop")
